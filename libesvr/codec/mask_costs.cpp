#include "codec/mask_costs.h"

#include <cmath>

namespace esvr::codec {
namespace {

/// What is added to each count, so that nothing is impossible (the estimator of Krichevsky and
/// Trofimov).
constexpr double kPrior = 0.5;

struct Interval {
  int first, last;
};

/// The coordinates of the voxels of a cube that lie in the brick at a step.
Interval within(int step) {
  if (step < 0) return {-1, -1};
  return step > 0 ? Interval{kBrickSide, kBrickSide} : Interval{0, kBrickSide - 1};
}

}  // namespace

void MaskCube::fillPart(Coord step, const Masks& masks) {
  const auto in = [](const BrickMask* mask, Coord voxel) {
    return mask && mask->test(voxelOffset(localOf(voxel)));
  };
  const Interval xs = within(step.x), ys = within(step.y), zs = within(step.z);
  for (int x = xs.first; x <= xs.last; ++x)
    for (int y = ys.first; y <= ys.last; ++y)
      for (int z = zs.first; z <= zs.last; ++z) {
        active_[at(x, y, z)] = in(masks.own, {x, y, z});
        expected_[at(x, y, z)] = in(masks.expected, {x, y, z});
        coded_[at(x, y, z)] = masks.own != nullptr;
      }
}

void MaskCounts::add(const MaskCube& cube) {
  for (int x = 0; x < kBrickSide; ++x)
    for (int y = 0; y < kBrickSide; ++y)
      for (int z = 0; z < kBrickSide; ++z) {
        const std::size_t at = MaskCube::at(x, y, z);
        ++counts_[cube.context(at)][cube.active(at)];
      }
}

void MaskCounts::add(const MaskCounts& other) {
  for (std::size_t c = 0; c < counts_.size(); ++c)
    for (std::size_t state = 0; state < 2; ++state) counts_[c][state] += other.counts_[c][state];
}

MaskCosts MaskCounts::costs() const {
  MaskCosts costs;
  for (std::size_t c = 0; c < counts_.size(); ++c) {
    const double all = double(counts_[c][0] + counts_[c][1]) + 2.0 * kPrior;
    for (std::size_t state = 0; state < 2; ++state)
      costs.bits[c][state] = float(-std::log2((double(counts_[c][state]) + kPrior) / all));
  }
  return costs;
}

}  // namespace esvr::codec
