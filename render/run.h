#pragma once
/// Draws what was asked for.

#include "render/options.h"

namespace esvr::render {

/// \throws Error
void run(const Options& options);

}  // namespace esvr::render
