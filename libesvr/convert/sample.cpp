#include "convert/sample.h"

#include <algorithm>
#include <vector>

#include "codec/brick_coder.h"

namespace esvr::convert {
namespace {

/// The chosen bricks in increasing order.
std::vector<std::size_t> sampledBricks(const SparseVolume& volume, const SampleSize& size) {
  const auto order = codec::codingOrder(volume.bricks);
  const std::size_t length = size.bricks / size.runs, last = order.size() - length;
  std::vector<std::size_t> chosen;
  for (std::size_t run = 0; run < size.runs; ++run) {
    const std::size_t first = size.runs > 1 ? run * last / (size.runs - 1) : last / 2;
    chosen.insert(chosen.end(), order.begin() + std::ptrdiff_t(first),
                  order.begin() + std::ptrdiff_t(first + length));
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace

SparseVolume sampleOf(const SparseVolume& volume, const SampleSize& size) {
  if (volume.brickCount() <= size.bricks) return volume;
  SparseVolume sample;
  sample.origin = volume.origin;
  sample.background = volume.background;
  for (const std::size_t b : sampledBricks(volume, size)) {
    const auto values = volume.brickValues(b);
    sample.bricks.push_back(volume.bricks[b]);
    sample.active.push_back(volume.active[b]);
    sample.values.insert(sample.values.end(), values.begin(), values.end());
  }
  return sample;
}

}  // namespace esvr::convert
