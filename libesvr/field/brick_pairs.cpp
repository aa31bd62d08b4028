#include "field/brick_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_map>
#include <utility>

#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/volume.h"

namespace esvr {
namespace {

using EllipsoidRange = tbb::blocked_range<std::size_t>;

/// A set of bricks, which are stored as bits in blocks of 8^3 bricks. Its memory follows the number
/// of blocks, however often a brick is inserted.
class BrickSet {
 public:
  void insert(Coord brick) {
    BrickMask& block = blockAt(brickOf(brick));
    const int bit = voxelOffset(localOf(brick));
    if (block.test(bit)) return;
    block.set(bit);
    ++size_;
  }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Appends all bricks to a list, in any order.
  void appendTo(std::vector<Coord>& list) const {
    for (const auto& [place, block] : blocks_)
      for (int bit = 0; bit < kBrickVoxels; ++bit)
        if (block.test(bit)) list.push_back(place * kBrickSide + voxelLocal(bit));
  }

 private:
  struct HashOfBrick {
    std::size_t operator()(Coord brick) const { return std::size_t(hashOf(brick)); }
  };

  /// Bricks that follow each other mostly lie in the same block.
  BrickMask& blockAt(Coord place) {
    if (last_ == nullptr || place != lastPlace_) {
      last_ = &blocks_[place];  // stays where it is when others are added
      lastPlace_ = place;
    }
    return *last_;
  }

  std::unordered_map<Coord, BrickMask, HashOfBrick> blocks_;
  BrickMask* last_ = nullptr;
  Coord lastPlace_;
  std::uint64_t size_ = 0;
};

double determinant(const Matrix3& m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
         m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/// The bricks' middles lie between three pairs of planes (SlabTest). Around each middle lies a cube
/// as large as a brick, and the cubes do not overlap: their number is bounded by the volume between
/// planes that are moved outwards by half a brick.
double bricksBetweenSlabs(const Support& s) {
  constexpr double kHalf = kBrickSide / 2.0, kBrickVolume = kBrickVoxels;
  double volume = 8.0 / std::abs(determinant(s.L));
  for (int j = 0; j < 3; ++j) {
    const double* row = &s.L[3 * j];
    const double reach = std::abs(row[0]) + std::abs(row[1]) + std::abs(row[2]);
    volume *= slabBound(s, j) + kHalf * reach;
  }
  return volume / kBrickVolume;
}

}  // namespace

double maxBricks(const Support& support, const Box& within) {
  const double boxed = common(brickRange(support), within).volume();
  const double slabs = bricksBetweenSlabs(support);
  return slabs < boxed ? slabs : boxed;
}

double countBricks(std::span<const Support> supports, const Box& within, double enough) {
  constexpr std::int32_t kSlice = 64;  // bricks along x between two checks of the count
  BrickSet set;
  for (const Support& support : supports) {
    Box left = common(brickRange(support), within);
    for (; !left.empty() && double(set.size()) <= enough; left.min.x += kSlice) {
      Box slice = left;
      slice.max.x = std::min(left.max.x, left.min.x + kSlice - 1);
      forEachReachedBrick(support, slice, [&](Coord brick) { set.insert(brick); });
    }
  }
  return double(set.size());
}

void requireListable(std::span<const Support> supports, const Box& within) {
  constexpr double kMaxListed = 0x1p32;
  double bricks = 0.0;
  for (const Support& support : supports) bricks += maxBricks(support, within);
  if (bricks > kMaxListed)
    throw MemoryExceeded("the ellipsoids reach up to " + std::to_string(bricks) +
                         " bricks, more than 2^32");
}

std::vector<Coord> missingBricks(const BrickIndex& index, std::size_t ellipsoids,
                                 const SupportOf& supportOf, const Box& within) {
  tbb::enumerable_thread_specific<BrickSet> found;
  parallelFor(EllipsoidRange(0, ellipsoids, 64), [&](const EllipsoidRange& range) {
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

void makeOffsets(std::vector<std::uint32_t>& lengths) {
  constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max();
  std::uint64_t sum = 0;
  for (std::uint32_t& length : lengths) {
    const std::uint64_t begin = sum;
    sum += length;
    length = std::uint32_t(begin);
  }
  if (sum > kMax)
    throw RuntimeFailure("there are " + std::to_string(sum) +
                         " pairs of an ellipsoid and a brick, more than the " +
                         std::to_string(kMax) + " that lists hold");
}

namespace {

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

/// The bricks of some ellipsoids, one list behind the other.
struct PartLists {
  std::vector<std::uint32_t> lengths;  ///< by ellipsoid
  std::vector<std::uint32_t> bricks;   ///< numbers; kNone: the brick is in `missing`
  std::vector<Coord> missing;          ///< bricks without a number, in their order
};
constexpr std::size_t kPartSize = 64;  ///< ellipsoids of a part

/// Lists the bricks of all ellipsoids with one walk around each. Parts are filled in parallel.
/// \param list  list(support, part) appends the bricks of a support
template <class List>
std::vector<PartLists> listParts(std::size_t ellipsoids, const SupportOf& supportOf,
                                 const List& list) {
  std::vector<PartLists> parts((ellipsoids + kPartSize - 1) / kPartSize);
  parallelFor(std::size_t(0), parts.size(), [&](std::size_t p) {
    PartLists& part = parts[p];
    for (std::size_t i = p * kPartSize; i < std::min(ellipsoids, (p + 1) * kPartSize); ++i) {
      const std::size_t before = part.bricks.size();
      list(supportOf(i), part);
      part.lengths.push_back(std::uint32_t(part.bricks.size() - before));
    }
  });
  return parts;
}

/// Joins the lists of all ellipsoids and clears the parts.
/// \param begin  gets the first place of each ellipsoid's list, and the end
std::vector<std::uint32_t> joinLists(std::vector<PartLists>& parts,
                                     std::vector<std::uint32_t>& begin) {
  for (const PartLists& part : parts)
    begin.insert(begin.end(), part.lengths.begin(), part.lengths.end());
  begin.push_back(0);
  makeOffsets(begin);
  std::vector<std::uint32_t> bricks(begin.back());
  parallelFor(std::size_t(0), parts.size(), [&](std::size_t p) {
    std::copy(parts[p].bricks.begin(), parts[p].bricks.end(),
              bricks.begin() + begin[p * kPartSize]);
    parts[p] = {};
  });
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
  auto parts = listParts(ellipsoids, supportOf, [&](const Support& support, PartLists& part) {
    forEachPair(index, support, [&](std::uint32_t b) { part.bricks.push_back(b); });
  });
  BrickPairs pairs;
  const auto bricks = joinLists(parts, pairs.ellipsoidBegin);
  PairSort(bricks, index.size(), pairs).sort();
  return pairs;
}

BrickPairs pairsOfAll(BrickIndex& index, std::size_t ellipsoids, const SupportOf& supportOf,
                      const Box& within) {
  Box everything = within;
  if (!index.bounds().empty()) everything.expand(index.bounds());
  auto parts = listParts(ellipsoids, supportOf, [&](const Support& support, PartLists& part) {
    forEachReachedBrick(support, everything, [&](Coord brick) {
      const std::uint32_t b = index.find(brick);
      if (b == BrickIndex::kNone) {
        if (!within.contains(brick)) return;
        part.missing.push_back(brick);
      }
      part.bricks.push_back(b);
    });
  });
  std::vector<Coord> missing;
  for (const PartLists& part : parts)
    missing.insert(missing.end(), part.missing.begin(), part.missing.end());
  tbb::parallel_sort(missing.begin(), missing.end());
  missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
  index.append(missing);
  parallelFor(std::size_t(0), parts.size(), [&](std::size_t p) {
    auto next = parts[p].missing.begin();
    for (std::uint32_t& b : parts[p].bricks)
      if (b == BrickIndex::kNone) b = index.find(*next++);
  });
  BrickPairs pairs;
  const auto bricks = joinLists(parts, pairs.ellipsoidBegin);
  PairSort(bricks, index.size(), pairs).sort();
  return pairs;
}

BrickPairs pairsWith(std::span<const Support> reach, std::span<const Coord> corners) {
  std::vector<Coord> bricks;
  bricks.reserve(corners.size());
  for (const Coord corner : corners) bricks.push_back(brickOf(corner));
  return pairsWithin(BrickIndex(bricks), reach.size(),
                     [&](std::size_t i) -> const Support& { return reach[i]; });
}

}  // namespace esvr
