#include "field/ssim_window.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace esvr {
namespace {

constexpr double kLuminance = 0.01, kContrast = 0.03;  // K1 and K2 of Wang et al. 2004

constexpr int kSlice = kHaloSide * kHaloSide;

}  // namespace

SsimConstants ssimConstants(double peak) {
  return {kLuminance * peak * kLuminance * peak, kContrast * peak * kContrast * peak};
}

std::array<double, kSsimTaps> ssimWeights() {
  std::array<double, kSsimTaps> weights;
  for (int i = 0; i < kSsimTaps; ++i) {
    const double t = (i - kSsimRadius) / kSsimSigma;
    weights[i] = std::exp(-0.5 * t * t);
  }
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (double& weight : weights) weight /= sum;
  return weights;
}

double SsimWindow::weightWithin(std::int64_t at, std::int64_t low, std::int64_t high) const {
  const auto first = std::max<std::int64_t>(low - (at - kSsimRadius), 0);
  const auto last = std::min<std::int64_t>(high - (at - kSsimRadius), kSsimTaps - 1);
  double sum = 0.0;
  for (auto tap = first; tap <= last; ++tap) sum += weights_[std::size_t(tap)];
  return sum;
}

Box windowsThatSee(const Box& halo) {
  if (halo.empty()) return Box{};
  const Coord reach{kSsimTaps - 1, kSsimTaps - 1, kSsimTaps - 1};
  return {maxCoord(halo.min - reach, kWholeBrick.min), minCoord(halo.max, kWholeBrick.max)};
}

Box seenByWindows(const Box& voxels) {
  if (voxels.empty()) return Box{};
  return {voxels.min, voxels.max + Coord{kSsimTaps - 1, kSsimTaps - 1, kSsimTaps - 1}};
}

Box SsimWindow::Extent::read() const {
  if (support.empty()) return Box{};
  Box seen = seenByWindows(voxels);
  seen.min.y = std::max(seen.min.y, support.min.y);
  seen.max.y = std::min(seen.max.y, support.max.y);
  return seen;
}

void SsimWindow::alongX(const HaloValues& values, const Extent& extent) {
  const Box seen = seenByWindows(extent.voxels), read = extent.read();
  const int first = seen.min.y * kHaloSide, last = (seen.max.y + 1) * kHaloSide;
  const int begin = read.min.y * kHaloSide, end = (read.max.y + 1) * kHaloSide;
  for (int x = extent.voxels.min.x; x <= extent.voxels.max.x; ++x) {
    double* slice = &sumsX_[x * kSlice];
    std::fill(slice + first, slice + begin, 0.0);
    kernels_.sumTaps(weights_.data(), &values[x * kSlice + begin], kSlice, slice + begin,
                     end - begin);
    std::fill(slice + end, slice + last, 0.0);
  }
}

void SsimWindow::alongY(const Box& voxels) {
  const int rows = voxels.max.y - voxels.min.y + 1;
  for (int x = voxels.min.x; x <= voxels.max.x; ++x)
    kernels_.sumTaps(weights_.data(), &sumsX_[x * kSlice + voxels.min.y * kHaloSide], kHaloSide,
                     &sumsXy_[(x * kBrickSide + voxels.min.y) * kHaloSide], rows * kHaloSide);
}

void SsimWindow::alongZ(const Box& voxels, BrickSums& out) const {
  const int rows = voxels.max.y - voxels.min.y + 1;
  for (int x = voxels.min.x; x <= voxels.max.x; ++x) {
    const int row = x * kBrickSide + voxels.min.y;
    kernels_.sumRows(weights_.data(), &sumsXy_[row * kHaloSide], &out[row * kBrickSide], rows);
  }
}

void SsimWindow::sumProducts(const HaloValues& a, const HaloValues& b, const Extent& extent,
                             BrickSums& out) {
  const Box read = extent.read();
  const int count = (read.max.y - read.min.y + 1) * kHaloSide;
  for (int x = read.min.x; x <= read.max.x; ++x) {
    const int row = haloOffset(x, read.min.y, 0);
    kernels_.multiply(&a[row], &b[row], &products_[row], count);
  }
  sum(products_, extent, out);
}

void SsimWindow::sum(const HaloValues& values, const Extent& extent, BrickSums& out) {
  if (extent.voxels.empty()) return;
  if (extent.read().empty()) return out.fill(0.0);
  alongX(values, extent);
  alongY(extent.voxels);
  alongZ(extent.voxels, out);
}

}  // namespace esvr
