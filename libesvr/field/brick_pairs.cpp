#include "field/brick_pairs.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <utility>

#include "field/brick_walk.h"
#include "field/offsets.h"

namespace esvr {
namespace {

using Range = tbb::blocked_range<std::size_t>;

/// Calls visit(number) for the bricks of an index that a support may touch, in the order of their
/// coordinates. It searches the bricks around the support or those of the index, whichever is
/// fewer.
template <class Visit>
void forEachPair(const BrickIndex& index, const Support& support, Visit&& visit) {
  constexpr double kLookUps = 16.0;  // find() takes a fraction of what SlabTest and sorting take
  const Box around = common(brickRange(support), index.bounds());
  if (around.volume() <= kLookUps * double(index.size()))
    return forEachReachedBrick(support, index.bounds(), [&](Coord brick) {
      if (const auto b = index.find(brick); b != BrickIndex::kNone) visit(b);
    });
  const SlabTest mayTouch(support);
  std::vector<std::uint32_t> touched;
  for (std::uint32_t b = 0; b < index.size(); ++b)
    if (around.contains(index.bricks()[b]) && mayTouch(index.bricks()[b])) touched.push_back(b);
  std::sort(touched.begin(), touched.end(), [&](std::uint32_t a, std::uint32_t b) {
    return index.bricks()[a] < index.bricks()[b];
  });
  for (const std::uint32_t b : touched) visit(b);
}

/// Calls visit(ellipsoid, n, brick) for every pair; n counts the pairs of the ellipsoid. Ellipsoids
/// are visited in parallel.
template <class Visit>
void visitPairs(const BrickIndex& index, std::size_t ellipsoids, const SupportOf& supportOf,
                Visit&& visit) {
  tbb::parallel_for(Range(0, ellipsoids, 64), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      std::uint32_t n = 0;
      forEachPair(index, supportOf(i), [&](std::uint32_t b) { visit(i, n++, b); });
    }
  });
}

/// Lists the bricks of all ellipsoids, one list behind the other.
std::vector<std::uint32_t> bricksByEllipsoid(const BrickIndex& index, std::size_t ellipsoids,
                                             const SupportOf& supportOf,
                                             std::vector<std::uint32_t>& begin) {
  begin.assign(ellipsoids + 1, 0);
  visitPairs(index, ellipsoids, supportOf,
             [&](std::size_t i, std::uint32_t n, std::uint32_t) { begin[i] = n + 1; });
  makeOffsets(begin);
  std::vector<std::uint32_t> bricks(begin.back());
  visitPairs(index, ellipsoids, supportOf,
             [&](std::size_t i, std::uint32_t n, std::uint32_t b) { bricks[begin[i] + n] = b; });
  return bricks;
}

/// A list of bricks to which a brick is added again and again. It takes at most twice the memory of
/// its different bricks, or that of kFew bricks.
class BrickList {
 public:
  void add(Coord brick) {
    if (bricks_.size() >= most_) makeUnique();
    bricks_.push_back(brick);
  }
  [[nodiscard]] std::vector<Coord> take() {
    makeUnique();
    return std::move(bricks_);
  }

 private:
  static constexpr std::size_t kFew = std::size_t{1} << 20;

  void makeUnique() {
    std::ranges::sort(bricks_);
    bricks_.erase(std::unique(bricks_.begin(), bricks_.end()), bricks_.end());
    most_ = std::max(kFew, 2 * bricks_.size());
  }

  std::vector<Coord> bricks_;
  std::size_t most_ = kFew;
};

}  // namespace

BrickPairs pairsWithin(const BrickIndex& index, std::size_t ellipsoids,
                       const SupportOf& supportOf) {
  BrickPairs pairs;
  const auto bricks = bricksByEllipsoid(index, ellipsoids, supportOf, pairs.ellipsoidBegin);
  pairs.brickBegin.assign(index.size() + 1, 0);
  for (const auto b : bricks) ++pairs.brickBegin[b];
  makeOffsets(pairs.brickBegin);

  pairs.ellipsoid.resize(bricks.size());
  pairs.pairOf.resize(bricks.size());
  auto next = pairs.brickBegin;
  for (std::size_t i = 0; i < ellipsoids; ++i)
    for (auto k = pairs.ellipsoidBegin[i]; k != pairs.ellipsoidBegin[i + 1]; ++k) {
      const auto pair = next[bricks[k]]++;
      pairs.ellipsoid[pair] = std::uint32_t(i);
      pairs.pairOf[k] = pair;
    }
  return pairs;
}

std::vector<Coord> missingBricks(const BrickIndex& index, std::size_t ellipsoids,
                                 const SupportOf& supportOf, const Box& within) {
  tbb::enumerable_thread_specific<BrickList> found;
  tbb::parallel_for(Range(0, ellipsoids, 64), [&](const Range& range) {
    auto& mine = found.local();
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      forEachReachedBrick(supportOf(i), within, [&](Coord brick) {
        if (index.find(brick) == BrickIndex::kNone) mine.add(brick);
      });
  });
  std::vector<Coord> all;
  for (BrickList& part : found) {
    const std::vector<Coord> bricks = part.take();
    all.insert(all.end(), bricks.begin(), bricks.end());
  }
  tbb::parallel_sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

}  // namespace esvr
