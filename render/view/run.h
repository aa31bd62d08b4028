#pragma once
/// Carries out the options of esvr-view.

#include "render/view/options.h"

namespace esvr::view {

/// Writes a page if one is to be exported; otherwise serves the page until SIGINT or SIGTERM.
/// \throws Error
void run(const Options& options);

}  // namespace esvr::view
