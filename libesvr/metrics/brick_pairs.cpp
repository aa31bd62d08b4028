#include "metrics/brick_pairs.h"

#include <algorithm>
#include <cstdint>
#include <span>

namespace esvr::metrics {
namespace {

/// True if an inactive voxel has the negated background, as inside the surface of a narrow band.
bool hasNegatedBackground(const SparseVolume& volume) {
  if (!(volume.background > 0.0f)) return false;
  for (std::size_t i = 0; i < volume.values.size(); ++i)
    if (volume.values[i] == -volume.background &&
        !volume.active[i / kBrickVoxels].test(int(i % kBrickVoxels)))
      return true;
  return false;
}

/// True if most voxels of the slice of a brick at z have negative values.
bool isSliceNegative(std::span<const float> values, int z) {
  int negative = 0;
  for (int line = z; line < kBrickVoxels; line += kBrickSide) negative += values[line] < 0.0f;
  return 2 * negative > kBrickSide * kBrickSide;
}

/// The bricks of one volume by their positions in index space.
class BrickCursor {
 public:
  explicit BrickCursor(const SparseVolume& volume)
      : volume_(volume),
        origin_(brickOf(volume.origin)),
        narrowBand_(hasNegatedBackground(volume)) {}

  [[nodiscard]] bool done() const { return at_ == volume_.brickCount(); }
  [[nodiscard]] Coord brick() const { return origin_ + volume_.bricks[at_]; }
  [[nodiscard]] bool isAt(Coord place) const { return !done() && brick() == place; }
  [[nodiscard]] const float* values() const { return volume_.brickValues(at_).data(); }
  [[nodiscard]] const BrickMask* active() const { return &volume_.active[at_]; }
  void advance() { ++at_; }

  /// The value at a place without a brick between the brick before and this one. In a narrow band,
  /// the next brick along -z, or else along z, gives the sign with the slice that faces the place.
  /// Without such bricks the place is outside, because a line along z that is inside somewhere
  /// crosses the surface.
  [[nodiscard]] float emptyValue(Coord place) const {
    const bool before = at_ > 0 && isInColumn(at_ - 1, place);
    const bool after = !done() && isInColumn(at_, place);
    bool inside = false;
    if (narrowBand_ && before)
      inside = isSliceNegative(volume_.brickValues(at_ - 1), kBrickSide - 1);
    else if (narrowBand_ && after)
      inside = isSliceNegative(volume_.brickValues(at_), 0);
    return inside ? -volume_.background : volume_.background;
  }

 private:
  [[nodiscard]] bool isInColumn(std::size_t b, Coord place) const {
    const Coord brick = origin_ + volume_.bricks[b];
    return brick.x == place.x && brick.y == place.y;
  }

  const SparseVolume& volume_;
  Coord origin_;
  bool narrowBand_;
  std::size_t at_ = 0;
};

Coord nextPlace(const BrickCursor& a, const BrickCursor& b) {
  if (a.done()) return b.brick();
  if (b.done()) return a.brick();
  return std::min(a.brick(), b.brick());
}

std::int32_t clampLocal(std::int64_t coordinate) {
  return std::int32_t(std::clamp<std::int64_t>(coordinate, -1, kBrickSide));
}

}  // namespace

std::vector<BrickPair> pairBricks(const SparseVolume& reference, const SparseVolume& candidate) {
  BrickCursor a(reference), b(candidate);
  std::vector<BrickPair> pairs;
  pairs.reserve(std::max(reference.brickCount(), candidate.brickCount()));
  while (!a.done() || !b.done()) {
    BrickPair pair{.brick = nextPlace(a, b)};
    pair.referenceEmpty = a.emptyValue(pair.brick);
    pair.candidateEmpty = b.emptyValue(pair.brick);
    if (a.isAt(pair.brick)) {
      pair.reference = a.values();
      pair.referenceActive = a.active();
      a.advance();
    }
    if (b.isAt(pair.brick)) {
      pair.candidate = b.values();
      pair.candidateActive = b.active();
      b.advance();
    }
    pairs.push_back(pair);
  }
  return pairs;
}

Box localBox(Coord brick, const Box& box) {
  const auto low = [](std::int32_t side, std::int32_t brickSide) {
    return std::max(clampLocal(std::int64_t(side) - std::int64_t(brickSide) * kBrickSide), 0);
  };
  const auto high = [](std::int32_t side, std::int32_t brickSide) {
    return std::min(clampLocal(std::int64_t(side) - std::int64_t(brickSide) * kBrickSide),
                    kBrickSide - 1);
  };
  return {{low(box.min.x, brick.x), low(box.min.y, brick.y), low(box.min.z, brick.z)},
          {high(box.max.x, brick.x), high(box.max.y, brick.y), high(box.max.z, brick.z)}};
}

}  // namespace esvr::metrics
