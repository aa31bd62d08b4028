#include "field/brick_halo.h"

#include <algorithm>

namespace esvr {
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

}  // namespace esvr
