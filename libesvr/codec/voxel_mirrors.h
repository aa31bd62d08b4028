#pragma once
/// Finds the mirror images of voxels for the voxel coder.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "codec/voxel_model.h"
#include "core/axes.h"
#include "core/brick_index.h"

namespace esvr::codec {

/// The mirror image of a voxel, if it was coded before the voxel.
struct Image {
  std::int32_t code = 0;
  bool active = false;
  bool vacant = false;
};

/// Finds the image of a voxel, along the first axis on which an image lies before it.
class Mirrors {
 public:
  Mirrors(const VoxelModel& model, const VoxelLayer& layer, const BrickIndex& index)
      : model_(model), layer_(layer), index_(index), any_(hasMirror(model)) {}

  /// True if the model has a mirror.
  [[nodiscard]] bool any() const { return any_; }

  [[nodiscard]] std::optional<Image> imageOf(Coord voxel) {
    if (!any_) return std::nullopt;
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int32_t place = model_.mirror[a] - voxel.*kAxes[a];
      if (model_.mirror[a] == VoxelModel::kNoMirror || place >= voxel.*kAxes[a]) continue;
      voxel.*kAxes[a] = place;
      return at(voxel);
    }
    return std::nullopt;
  }

 private:
  Image at(Coord voxel) {
    const Coord brick = brickOf(voxel);
    if (brick != lastBrick_) {
      lastBrick_ = brick;
      last_ = index_.find(brick);
    }
    if (last_ == BrickIndex::kNone) return {model_.vacantCode, false, true};
    const int v = voxelOffset(localOf(voxel));
    return {layer_.codes[last_ * std::size_t(kBrickVoxels) + std::size_t(v)],
            layer_.active[last_].test(v), layer_.vacant[last_].test(v)};
  }

  const VoxelModel& model_;
  const VoxelLayer& layer_;
  const BrickIndex& index_;
  Coord lastBrick_{Box::kMin, 0, 0};
  std::uint32_t last_ = BrickIndex::kNone;
  bool any_;
};

}  // namespace esvr::codec
