#pragma once
/// What is drawn: the texts of the options that say how a grid looks, and the options of a picture
/// of the grids of a file.

#include <optional>
#include <string>
#include <vector>

#include "programs/pictures.h"
#include "render/options.h"
#include "render/scene.h"

namespace esvr::render {

/// The texts of a grid's look.
struct LookText {
  std::optional<std::string> colors, opacity, tf, preset;
  std::string range = "auto";
};

/// \param usualColors  color map unless one is given
/// \throws UsageError  the texts are wrong or exclude each other
/// \throws BadInput    the file of a transfer function is wrong
[[nodiscard]] Look lookOf(const LookText& text, const std::string& usualColors);

/// Reads the text of --with: NAME[:KEY=VALUE]...[:emission]
/// \throws UsageError, BadInput  as for lookOf
[[nodiscard]] FurtherGrid furtherGridOf(const std::string& text);

/// The options of a picture without its cancel token.
/// \param scenes  the grid, and those of --with
[[nodiscard]] RenderOptions renderOptions(const Options& options, const std::vector<Scene>& scenes);

/// The color bar that is drawn into pictures; nothing without --legend.
[[nodiscard]] std::optional<report::ColorBar> barOf(const Options& options, const Scene& scene);

/// The point about which a turntable turns.
[[nodiscard]] Vec3 pivotOf(const Options& options, const std::vector<Scene>& scenes);

}  // namespace esvr::render
