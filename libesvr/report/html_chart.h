#pragma once
/// A plot within a page, in the colors of the page. Its points can be read out with the pointer and
/// the arrow keys.

#include "report/html.h"
#include "report/plot.h"

namespace esvr::report {

/// Draws the plot twice, for wide and for narrow screens; the page shows one of them. The title of
/// each point says its curve and its values.
[[nodiscard]] Html toHtml(const Plot& plot);

}  // namespace esvr::report
