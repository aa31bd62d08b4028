#pragma once
/// Carries out the options of esvr-view.

#include "render/view/options.h"

namespace esvr::view {

/// Serves the page until SIGINT or SIGTERM.
/// \throws Error
void run(const Options& options);

}  // namespace esvr::view
