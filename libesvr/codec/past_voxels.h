#pragma once
/// The voxels that a frame refers to, as numbers on the lattice of the frame that is coded. They are
/// those of the previous frame, or those of another grid whose values are mapped. A brick may have moved since.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/brick_index.h"
#include "esvr/quantised.h"

namespace esvr::codec {

/// A cube of voxels of the previous frame around a brick.
template <int kMargin>
struct PastCube {
  static constexpr int kSide = kBrickSide + 2 * kMargin;
  static constexpr int kStepX = kSide * kSide, kStepY = kSide, kStepZ = 1;
  static constexpr std::size_t kCells = std::size_t(kSide) * kSide * kSide;

  std::array<double, kCells> place;  ///< values in units of the codes
  std::array<bool, kCells> active;

  static std::size_t cell(Coord local) {
    return std::size_t((local.x + kMargin) * kStepX + (local.y + kMargin) * kStepY + local.z +
                       kMargin);
  }
};

/// True if the origins are near enough to each other for `now` to be predicted from `past`, and
/// vacant voxels of `now` have the code of the background.
[[nodiscard]] bool isPredictable(const VoxelLayer& now, const VoxelLayer& past);

/// The value gain * v + offset in place of v. The default changes nothing.
struct ValueMap {
  double gain = 1.0, offset = 0.0;
  friend bool operator==(const ValueMap&, const ValueMap&) = default;
};

class PastVoxels {
 public:
  /// \param past  the layer of the previous frame, which must outlive this object
  /// \param now   the frame that is coded: its form, divisor, palette, background and origin
  /// \param map   of the values of `past`
  PastVoxels(const VoxelLayer& past, const VoxelLayer& now, const ValueMap& map = {});

  [[nodiscard]] const VoxelLayer& layer() const { return past_; }
  /// Position of the bricks of the previous frame relative to the origin of the frame.
  [[nodiscard]] Coord brickAt(std::size_t b) const { return past_.bricks[b] + shift_; }
  /// The brick of the previous frame at a position relative to the origin of the frame, or
  /// BrickIndex::kNone.
  [[nodiscard]] std::uint32_t find(Coord brick) const { return index_.find(brick - shift_); }

  /// Copies the cube around the brick at `brick`, whose voxels are taken from places that are
  /// `motion` lower.
  template <int kMargin>
  void fill(Coord brick, Coord motion, PastCube<kMargin>& cube) const {
    const Coord first = brick * kBrickSide - motion;
    for (int x = -kMargin; x < kBrickSide + kMargin; ++x)
      for (int y = -kMargin; y < kBrickSide + kMargin; ++y) {
        const std::size_t cell = PastCube<kMargin>::cell({x, y, -kMargin});
        fillLine(first + Coord{x, y, -kMargin}, PastCube<kMargin>::kSide, &cube.place[cell],
                 &cube.active[cell]);
      }
  }

 private:
  void fillLine(Coord voxel, int count, double* place, bool* active) const;

  const VoxelLayer& past_;
  BrickIndex index_;
  Coord shift_;                ///< what is added to places in the previous frame, in bricks
  double vacantPlace_ = 0.0;   ///< place of voxels that are vacant or have no brick
  VoxelArray<double> places_;  ///< places of all voxels of the previous frame
};

// ---- Motion

/// Largest motion of a brick along an axis, in voxels.
inline constexpr int kLargestMotion = 4;

/// Finds the motion of a brick since the previous frame.
class MotionSearch {
 public:
  explicit MotionSearch(const PastVoxels& past)
      : past_(past), cube_(std::make_unique<PastCube<kLargestMotion>>()) {}

  /// The motion found from which the previous frame differs least from a brick. The search descends
  /// from no motion and from `expected`, which is taken unless another one is clearly better.
  [[nodiscard]] Coord find(Coord brick, std::span<const std::int32_t> codes, Coord expected);

 private:
  [[nodiscard]] double costOf(Coord motion, std::span<const std::int32_t> codes,
                              Coord expected) const;

  const PastVoxels& past_;
  std::unique_ptr<PastCube<kLargestMotion>> cube_;
};

}  // namespace esvr::codec
