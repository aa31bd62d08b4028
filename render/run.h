#pragma once
/// Carries out the options of esvr-render.

#include "render/options.h"

namespace esvr::render {

/// \throws Error
void run(const Options& options);

}  // namespace esvr::render
