#pragma once
/// Finds and makes copies. A brick is a copy if all its voxels equal voxels that are coded before
/// them: those of the neighbouring brick along an axis, or their mirror images. If the neighbouring
/// brick or a mirror image does not exist, vacant voxels take its place.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "codec/voxel_mirrors.h"
#include "core/axes.h"
#include "core/brick_index.h"

namespace esvr::codec {

class BrickCopies {
 public:
  /// The source of a copy is a number: 0, 1 and 2 are the neighbours along x, y and z, and this one
  /// stands for the mirror images.
  static constexpr std::uint32_t kImageSource = 3;
  static constexpr int kSourceBits = 2;

  BrickCopies(const VoxelModel& model, VoxelLayer& layer, const BrickIndex& index, Mirrors& mirrors)
      : model_(model), layer_(layer), index_(index), mirrors_(mirrors) {}

  /// The first source whose voxels equal those of brick b; nothing if there is none.
  [[nodiscard]] std::optional<std::uint32_t> sourceOf(std::size_t b) {
    for (std::uint32_t axis = 0; axis < kImageSource; ++axis)
      if (equals(b, before(b, axis))) return axis;
    return mirrors_.any() && equalsImages(b) ? std::optional(kImageSource) : std::nullopt;
  }

  /// Sets the voxels of brick b, which must have no active and no vacant voxel yet.
  void copy(std::size_t b, std::uint32_t source) {
    if (source == kImageSource) return copyImages(b);
    copyBrick(b, before(b, source));
  }

  /// The brick before brick b along an axis, or BrickIndex::kNone.
  [[nodiscard]] std::uint32_t before(std::size_t b, std::uint32_t axis) const {
    Coord brick = layer_.bricks[b];
    --(brick.*kAxes[axis]);
    return index_.find(brick);
  }

 private:
  [[nodiscard]] auto codesOf(std::size_t b) const {
    return layer_.codes.begin() + std::ptrdiff_t(b * kBrickVoxels);
  }

  [[nodiscard]] bool equals(std::size_t b, std::uint32_t other) const {
    if (other == BrickIndex::kNone) return layer_.vacant[b].count() == kBrickVoxels;
    return layer_.active[b] == layer_.active[other] && layer_.vacant[b] == layer_.vacant[other] &&
           std::equal(codesOf(b), codesOf(b) + kBrickVoxels, codesOf(other));
  }

  void copyBrick(std::size_t b, std::uint32_t other) {
    if (other == BrickIndex::kNone) {
      layer_.vacant[b].setAll();
      std::fill_n(codesOf(b), kBrickVoxels, model_.vacantCode);
      return;
    }
    layer_.active[b] = layer_.active[other];
    layer_.vacant[b] = layer_.vacant[other];
    std::copy_n(codesOf(other), kBrickVoxels, codesOf(b));
  }

  /// The image of voxel v of a brick, or a vacant voxel.
  [[nodiscard]] Image imageOf(std::size_t b, int v) {
    const auto image = mirrors_.imageOf(layer_.bricks[b] * kBrickSide + voxelLocal(v));
    return image.value_or(Image{model_.vacantCode, false, true});
  }

  [[nodiscard]] bool equalsImages(std::size_t b) {
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Image image = imageOf(b, v);
      if (image.active != layer_.active[b].test(v) || image.vacant != layer_.vacant[b].test(v) ||
          image.code != codesOf(b)[v])
        return false;
    }
    return true;
  }

  void copyImages(std::size_t b) {
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Image image = imageOf(b, v);
      codesOf(b)[v] = image.code;
      if (image.active) layer_.active[b].set(v);
      if (image.vacant) layer_.vacant[b].set(v);
    }
  }

  const VoxelModel& model_;
  VoxelLayer& layer_;
  const BrickIndex& index_;
  Mirrors& mirrors_;
};

}  // namespace esvr::codec
