#include <algorithm>

#include "capi/objects.h"
#include "page/page.h"

using namespace esvr;

void page_histogram(const esvr_volume* volume, double low, double high, int count, double* counts) {
  std::fill_n(counts, count, 0.0);
  const double perUnit = high > low ? count / (high - low) : 0.0;
  const SparseVolume& voxels = volume->voxels;
  for (std::size_t b = 0; b < voxels.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (!voxels.active[b].test(v)) continue;
      const double place = (double(voxels.brickValues(b)[std::size_t(v)]) - low) * perUnit;
      ++counts[int(std::clamp(place, 0.0, double(count - 1)))];
    }
}
