#include "fit/cpu/interpolated_brick.h"

#include <algorithm>

#include "esvr/sparse_volume.h"

namespace esvr {
namespace {

constexpr int kReadSide = kBrickSide + 1;
constexpr int kReadRows = kReadSide * kReadSide;

/// The voxels that an interpolation reads, kReadSide along each axis, z fastest.
class Halo {
 public:
  Halo(const InterpolatedBricks& around, const std::array<OffsetAxis, 3>& axes, Missing missing)
      : around_(around), axes_(axes), missing_(missing) {
    for (int x = 0; x < kReadSide; ++x)
      for (int y = 0; y < kReadSide; ++y)
        fillRow(offsetPlace(axes[0], x), offsetPlace(axes[1], y),
                values_ + (x * kReadSide + y) * kReadSide);
  }
  [[nodiscard]] const float* row(int n) const { return values_ + n * kReadSide; }

 private:
  /// Fills a row: the voxels that lie in one brick, and a voxel of the next brick along z.
  void fillRow(const OffsetPlace& x, const OffsetPlace& y, float* to) const {
    const int column = 4 * int(x.next) + 2 * int(y.next);
    const float* const own = rowOf(column, x, y);
    const float* const next = rowOf(column + 1, x, y);
    const bool exists = around_[std::size_t(column) + 1] != nullptr;
    const bool before = axes_[2].first < 0;
    std::copy_n(own, kBrickSide, before ? to + 1 : to);
    // The next brick touches this one with its last voxel if it lies before it. A row that stands
    // for a missing one has the nearest voxel at its other end.
    (before ? to[0] : to[kBrickSide]) = next[before == exists ? kBrickSide - 1 : 0];
  }

  /// The row of a brick; if the target does not have the brick, the row that stands for it.
  [[nodiscard]] const float* rowOf(int brick, const OffsetPlace& x, const OffsetPlace& y) const {
    static constexpr float kZeros[kBrickSide] = {};
    if (const float* const values = around_[std::size_t(brick)])
      return values + rowAt(x.local, y.local);
    const bool nearest = missing_ == Missing::kNearest && around_[0];
    return nearest ? around_[0] + rowAt(x.nearest, y.nearest) : kZeros;
  }
  static std::size_t rowAt(int x, int y) { return std::size_t((x * kBrickSide + y) * kBrickSide); }

  const InterpolatedBricks& around_;
  const std::array<OffsetAxis, 3>& axes_;
  Missing missing_;
  float values_[kReadRows * kReadSide];
};

/// Writes a + weight (b - a).
void mix(const float* a, const float* b, float weight, int count, float* out) {
  for (int n = 0; n < count; ++n) out[n] = a[n] + weight * (b[n] - a[n]);
}

}  // namespace

void interpolateBrick(const InterpolatedBricks& around, const Offset& offset, Missing missing,
                      std::span<float> out) {
  const auto axes = offsetAxes(offset);
  const Halo halo(around, axes, missing);
  float plane[kReadRows], column[kBrickSide * kReadSide];
  for (int x = 0; x < kBrickSide; ++x) {
    mix(halo.row(x * kReadSide), halo.row((x + 1) * kReadSide), axes[0].weight, kReadRows, plane);
    mix(plane, plane + kReadSide, axes[1].weight, kBrickSide * kReadSide, column);
    for (int y = 0; y < kBrickSide; ++y) {
      const float* const row = column + y * kReadSide;
      mix(row, row + 1, axes[2].weight, kBrickSide,
          &out[std::size_t((x * kBrickSide + y) * kBrickSide)]);
    }
  }
}

}  // namespace esvr
