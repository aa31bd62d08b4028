#pragma once
/// The option --legend: the color bar of a transfer function.

#include "render/options.h"
#include "render/scene.h"
#include "report/color_bar.h"

namespace esvr::render {

/// The color bar of a picture of a scene.
/// \param transfer  over its range of values
[[nodiscard]] report::ColorBar legendOf(const Options& options, const Scene& scene,
                                        const TransferFunction& transfer);

}  // namespace esvr::render
