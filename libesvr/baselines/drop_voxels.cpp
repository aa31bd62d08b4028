#include "baselines/drop_voxels.h"

#include <algorithm>
#include <cmath>

namespace esvr::baselines {
namespace {

template <class Visit>
void visitActive(const SparseVolume& volume, const Visit& visit) {
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i)
      if (volume.active[b].test(i)) visit(volume.brickValues(b)[i]);
}

void clear(BrickMask& mask, int offset) {
  mask.words[offset >> 6] &= ~(std::uint64_t{1} << (offset & 63));
}

BrickInput brickWithout(const VolumeGrid& grid, std::size_t b, double threshold) {
  const Deviation deviation(grid.descriptor);
  const bool levelSet = grid.descriptor.gridClass == GridClass::kLevelSet;
  const float background = grid.volume.background;
  BrickInput brick{
      .corner = grid.volume.brickCorner(b), .values = {}, .active = grid.volume.active[b]};
  const auto values = grid.volume.brickValues(b);
  std::copy(values.begin(), values.end(), brick.values.begin());
  for (int i = 0; i < kBrickVoxels; ++i) {
    if (!brick.active.test(i) || double(deviation(values[i])) > threshold) continue;
    clear(brick.active, i);
    brick.values[i] = levelSet && values[i] < 0.0f ? -background : background;
  }
  return brick;
}

}  // namespace

float Deviation::operator()(float value) const {
  return levelSet_ ? std::abs(background_) - std::abs(value) : std::abs(value - background_);
}

std::vector<float> thresholds(const VolumeGrid& grid) {
  const Deviation deviation(grid.descriptor);
  std::vector<float> all;
  visitActive(grid.volume, [&](float value) { all.push_back(deviation(value)); });
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

VolumeGrid withoutVoxels(const VolumeGrid& grid, double threshold) {
  std::vector<BrickInput> bricks;
  for (std::size_t b = 0; b < grid.volume.brickCount(); ++b) {
    BrickInput brick = brickWithout(grid, b, threshold);
    if (brick.active.count() > 0) bricks.push_back(brick);
  }
  VolumeGrid result;
  result.descriptor = grid.descriptor;
  result.volume = makeVolume(std::move(bricks), grid.volume.background);
  return result;
}

}  // namespace esvr::baselines
