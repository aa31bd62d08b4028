#include "field/ssim_window.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

namespace esvr {

SsimConstants ssimConstants(double peak) {
  constexpr double kLuminance = 0.01, kContrast = 0.03;  // K1 and K2 of Wang et al. 2004
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

Box windowsThatSee(const Box& halo) {
  if (halo.empty()) return Box{};
  const Coord reach{kSsimTaps - 1, kSsimTaps - 1, kSsimTaps - 1};
  return {maxCoord(halo.min - reach, kWholeBrick.min), minCoord(halo.max, kWholeBrick.max)};
}

Box seenByWindows(const Box& voxels) {
  if (voxels.empty()) return Box{};
  return {voxels.min, voxels.max + Coord{kSsimTaps - 1, kSsimTaps - 1, kSsimTaps - 1}};
}

// Halos.

namespace {

/// The halo coordinates along one axis that a brick covers, and the brick's own coordinate at the
/// first of them.
struct Segment {
  int first, last, local;
};
/// The segments of the bricks at -1, 0 and 1.
constexpr Segment kSegments[3] = {{0, kSsimRadius - 1, kBrickSide - kSsimRadius},
                                  {kSsimRadius, kSsimRadius + kBrickSide - 1, 0},
                                  {kSsimRadius + kBrickSide, kHaloSide - 1, 0}};

Segment clipped(const Segment& s, int low, int high) {
  return {std::max(s.first, low), std::min(s.last, high), s.local + std::max(low - s.first, 0)};
}

/// Copies one of the 27 bricks. Its position along z is a template parameter, so that the compiler
/// unrolls the rows.
template <int kZ, class Value>
void copyBrick(const Value* brick, const Segment& xs, const Segment& ys, HaloValues& out) {
  constexpr Segment kZs = kSegments[kZ];
  constexpr int kCount = kZs.last - kZs.first + 1;
  for (int x = xs.first; x <= xs.last; ++x)
    for (int y = ys.first; y <= ys.last; ++y) {
      double* to = &out[std::size_t(haloOffset(x, y, kZs.first))];
      if (!brick) {
        std::fill_n(to, kCount, 0.0);
        continue;
      }
      const Value* from =
          brick + voxelOffset({x - xs.first + xs.local, y - ys.first + ys.local, kZs.local});
      std::copy_n(from, kCount, to);
    }
}

template <class Value>
void fill(const ValuesAround<Value>& bricks, const Box& seen, HaloValues& out) {
  if (seen.empty()) return;
  for (int i = 0; i < 9; ++i) {
    const Segment xs = clipped(kSegments[i / 3], seen.min.x, seen.max.x);
    const Segment ys = clipped(kSegments[i % 3], seen.min.y, seen.max.y);
    copyBrick<0>(bricks[std::size_t(3 * i)], xs, ys, out);
    copyBrick<1>(bricks[std::size_t(3 * i + 1)], xs, ys, out);
    copyBrick<2>(bricks[std::size_t(3 * i + 2)], xs, ys, out);
  }
}

}  // namespace

BricksAround bricksAround(const BrickIndex& index, Coord brick) {
  BricksAround around;
  auto* next = around.data();
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) *next++ = index.find(brick + Coord{x, y, z});
  return around;
}

Box haloSupport(const BricksAround& around, std::span<const Box> boxes) {
  Box support;
  for (int i = 0; i < int(around.size()); ++i) {
    const std::uint32_t brick = around[std::size_t(i)];
    if (brick == BrickIndex::kNone || boxes[brick].empty()) continue;
    const Coord corner = Coord{i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1} * kBrickSide +
                         Coord{kSsimRadius, kSsimRadius, kSsimRadius};
    const Box seen{maxCoord(boxes[brick].min + corner, kWholeHalo.min),
                   minCoord(boxes[brick].max + corner, kWholeHalo.max)};
    if (!seen.empty()) support.expand(seen);
  }
  return support;
}

void fillHalo(const ValuesAround<float>& bricks, const Box& seen, HaloValues& out) {
  fill(bricks, seen, out);
}
void fillHalo(const ValuesAround<double>& bricks, const Box& seen, HaloValues& out) {
  fill(bricks, seen, out);
}

// Sums.

namespace {

constexpr int kHaloSlice = kHaloSide * kHaloSide;

}  // namespace

double SsimWindow::weightWithin(std::int64_t at, std::int64_t low, std::int64_t high) const {
  const auto first = std::max<std::int64_t>(low - (at - kSsimRadius), 0);
  const auto last = std::min<std::int64_t>(high - (at - kSsimRadius), kSsimTaps - 1);
  double sum = 0.0;
  for (auto tap = first; tap <= last; ++tap) sum += weights_[std::size_t(tap)];
  return sum;
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
    double* slice = &sumsX_[x * kHaloSlice];
    std::fill(slice + first, slice + begin, 0.0);
    kernels_.sumTaps(weights_.data(), &values[x * kHaloSlice + begin], kHaloSlice, slice + begin,
                     end - begin);
    std::fill(slice + end, slice + last, 0.0);
  }
}

void SsimWindow::alongY(const Box& voxels) {
  const int rows = voxels.max.y - voxels.min.y + 1;
  for (int x = voxels.min.x; x <= voxels.max.x; ++x)
    kernels_.sumTaps(weights_.data(), &sumsX_[x * kHaloSlice + voxels.min.y * kHaloSide], kHaloSide,
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

// Bricks.

namespace {

using Coords = std::vector<Coord>;

Coords shifted(const Coords& bricks, Coord by) {
  Coords result(bricks);
  for (Coord& brick : result) brick = brick + by;
  return result;
}

Coords merged(const Coords& a, const Coords& b) {
  Coords result;
  result.reserve(a.size() + b.size());
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result));
  return result;
}

}  // namespace

std::vector<Coord> dilateBricks(std::span<const Coord> bricks) {
  // The set grows along one axis after the other. Shifted bricks keep their order, so this is a merge
  // of three lists.
  Coords grown(bricks.begin(), bricks.end());
  for (const Coord axis : {Coord{0, 0, 1}, Coord{0, 1, 0}, Coord{1, 0, 0}})
    grown = merged(merged(shifted(grown, axis * -1), grown), shifted(grown, axis));
  return grown;
}

}  // namespace esvr
