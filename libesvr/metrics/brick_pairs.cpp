#include "metrics/brick_pairs.h"

#include <algorithm>
#include <cstdint>

namespace esvr::metrics {
namespace {

/// The bricks of one volume by their positions in index space.
class BrickCursor {
 public:
  explicit BrickCursor(const SparseVolume& volume)
      : volume_(volume), origin_(brickOf(volume.origin)) {}

  [[nodiscard]] bool done() const { return at_ == volume_.brickCount(); }
  [[nodiscard]] Coord brick() const { return origin_ + volume_.bricks[at_]; }
  [[nodiscard]] bool isAt(Coord place) const { return !done() && brick() == place; }
  [[nodiscard]] const float* values() const { return volume_.brickValues(at_).data(); }
  [[nodiscard]] const BrickMask* active() const { return &volume_.active[at_]; }
  void advance() { ++at_; }

 private:
  const SparseVolume& volume_;
  Coord origin_;
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
