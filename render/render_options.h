#pragma once
/// What is drawn, by the options of a command and the grids of its input.

#include <optional>
#include <vector>

#include "render/options.h"
#include "render/scene.h"
#include "report/color_bar.h"

namespace esvr::render {

/// The options of a picture without its cancel token.
/// \param scenes  the grid, and those of --with
[[nodiscard]] RenderOptions renderOptions(const Options& options, const std::vector<Scene>& scenes);

/// The color bar that is drawn into pictures; nothing without --legend.
[[nodiscard]] std::optional<report::ColorBar> barOf(const Options& options, const Scene& scene);

/// The point about which a turntable turns.
[[nodiscard]] Vec3 pivotOf(const Options& options, const std::vector<Scene>& scenes);

}  // namespace esvr::render
