#include "field/brick_pairs.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_sort.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <utility>

#include "core/parallel.h"
#include "field/brick_set.h"
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
  parallelFor(Range(0, ellipsoids, 64), [&](const Range& range) {
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

/// Sorts pairs by brick. Parts of the ellipsoids are sorted in parallel; each part has its own places
/// in the list of a brick.
class PairSort {
 public:
  /// \param bricks  by pair: its brick, in the order of the ellipsoids
  PairSort(const std::vector<std::uint32_t>& bricks, std::size_t brickCount, BrickPairs& pairs)
      : bricks_(bricks), brickCount_(brickCount), pairs_(pairs) {}

  void sort() {
    // Tables of all parts take no more memory than a quarter of the pairs.
    const std::size_t most = bricks_.size() / 4 / std::max<std::size_t>(1, brickCount_);
    parts_ = std::clamp<std::size_t>(most, 1, std::size_t(tbb::this_task_arena::max_concurrency()));
    next_.assign(parts_ * brickCount_, 0);
    parallelFor(std::size_t(0), parts_, [&](std::size_t part) {
      for (std::size_t k = firstOf(part); k < firstOf(part + 1); ++k) ++next(part, bricks_[k]);
    });
    makePlaces();
    pairs_.ellipsoid.resize(bricks_.size());
    pairs_.pairOf.resize(bricks_.size());
    parallelFor(std::size_t(0), parts_, [&](std::size_t part) { place(part); });
  }

 private:
  [[nodiscard]] std::size_t firstOf(std::size_t part) const {
    return bricks_.size() * part / parts_;
  }
  std::uint32_t& next(std::size_t part, std::uint32_t brick) {
    return next_[part * brickCount_ + brick];
  }
  /// Turns the counts of the parts into their first places.
  void makePlaces() {
    std::uint32_t place = 0;
    pairs_.brickBegin.reserve(brickCount_ + 1);
    for (std::uint32_t b = 0; b < brickCount_; ++b) {
      pairs_.brickBegin.push_back(place);
      for (std::size_t part = 0; part < parts_; ++part)
        place += std::exchange(next(part, b), place);
    }
    pairs_.brickBegin.push_back(place);
  }
  void place(std::size_t part) {
    const auto& begin = pairs_.ellipsoidBegin;
    const std::size_t first = firstOf(part), past = firstOf(part + 1);
    std::size_t i = std::size_t(std::ranges::upper_bound(begin, first) - begin.begin()) - 1;
    for (std::size_t k = first; k < past; ++k) {
      while (k >= begin[i + 1]) ++i;
      const std::uint32_t pair = next(part, bricks_[k])++;
      pairs_.ellipsoid[pair] = std::uint32_t(i);
      pairs_.pairOf[k] = pair;
    }
  }

  const std::vector<std::uint32_t>& bricks_;
  const std::size_t brickCount_;
  BrickPairs& pairs_;
  std::size_t parts_ = 1;
  std::vector<std::uint32_t> next_;  ///< by part and brick
};

}  // namespace

BrickPairs pairsWithin(const BrickIndex& index, std::size_t ellipsoids,
                       const SupportOf& supportOf) {
  BrickPairs pairs;
  const auto bricks = bricksByEllipsoid(index, ellipsoids, supportOf, pairs.ellipsoidBegin);
  PairSort(bricks, index.size(), pairs).sort();
  return pairs;
}

std::vector<Coord> missingBricks(const BrickIndex& index, std::size_t ellipsoids,
                                 const SupportOf& supportOf, const Box& within) {
  tbb::enumerable_thread_specific<BrickSet> found;
  parallelFor(Range(0, ellipsoids, 64), [&](const Range& range) {
    auto& mine = found.local();
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      forEachReachedBrick(supportOf(i), within, [&](Coord brick) {
        if (index.find(brick) == BrickIndex::kNone) mine.insert(brick);
      });
  });
  std::vector<Coord> all;
  for (const BrickSet& part : found) part.appendTo(all);
  tbb::parallel_sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

}  // namespace esvr
