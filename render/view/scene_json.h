#pragma once
/// Scenes in messages (docs/pictures.md): what is drawn, with the options of esvr-render.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "cli/frame_range.h"
#include "render/options.h"

namespace esvr::view {

/// A grid of a frame of a file that the server shows.
struct GridPlace {
  std::size_t file = 0, grid = 0;
  std::optional<cli::FrameNumber> frame;  ///< nothing: the first frame, or the file has none
  friend auto operator<=>(const GridPlace&, const GridPlace&) = default;
};

/// What a picture shows of a reference.
enum class CompareShow { kSplit, kReference, kDifference };

struct Comparison {
  GridPlace with;
  CompareShow show = CompareShow::kSplit;
  double split = 0.5;  ///< share of the width, from the left, that shows the grid itself
  double gain = 10.0;  ///< factor of differences
};

struct SceneWish {
  GridPlace place;
  /// The look, the camera and the rays. The resolution and the input are not set.
  render::Options options;
  std::optional<double> slicePlace{};  ///< of options.clip, if it is a slice
  std::optional<std::size_t> sliceAxis{};
  std::optional<Comparison> compare{};
};

/// Reads the members "file", "grid" and "frame". Whether they exist is not checked.
/// \throws BadInput  they have the wrong form
[[nodiscard]] GridPlace placeOf(const nlohmann::json& content, const std::string& name);

/// \throws BadInput    a member is unknown or has the wrong form
/// \throws UsageError  members exclude each other; the transfer function is none
[[nodiscard]] SceneWish sceneOf(const nlohmann::json& content);

/// A camera as a member of messages.
[[nodiscard]] nlohmann::json jsonOf(const Camera& camera);

}  // namespace esvr::view
