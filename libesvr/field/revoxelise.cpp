/// Converts fields to voxels: the region of each brick in which voxels may be active, its voxels, and the
/// volume of all bricks; the evaluation of a field at any places; and estimates of the work. Places are sorted by bricks in groups, and the places of a brick
/// are evaluated in blocks that fill the registers.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/brick_index.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "field/brick_kernels.h"
#include "field/brick_pairs.h"
#include "field/evaluate.h"
#include "field/voxel_rule.h"

namespace esvr {

BrickMask maskOf(const Box& box, Coord corner) {
  const LocalBox local = localBox(box, corner, kBrickSide - 1);
  BrickMask mask;
  for (int x = local.low[0]; x <= local.high[0]; ++x)
    for (int y = local.low[1]; y <= local.high[1]; ++y)
      for (int z = local.low[2]; z <= local.high[2]; ++z) mask.set(voxelOffset({x, y, z}));
  return mask;
}

namespace {

/// The voxels of a brick among those that are always active.
BrickMask alwaysActiveIn(const RevoxeliseOptions& options, Coord corner) {
  BrickMask mask;
  for (const Coord voxel : options.alwaysActive)
    if (brickOf(voxel) == brickOf(corner)) mask.set(voxelOffset(localOf(voxel)));
  return mask;
}

}  // namespace

BrickRegion regionIn(const RevoxeliseOptions& options, Coord corner) {
  const BrickMask inBox = maskOf(options.box, corner);
  if (!options.restrictToBricks) return {inBox, alwaysActiveIn(options, corner)};
  const auto at = std::lower_bound(options.bricks.begin(), options.bricks.end(), corner);
  if (at == options.bricks.end() || *at != corner) return {};
  if (options.masks.empty()) return {inBox, alwaysActiveIn(options, corner)};
  BrickRegion region{inBox, options.masks[std::size_t(at - options.bricks.begin())]};
  for (std::size_t w = 0; w < inBox.words.size(); ++w)
    region.within.words[w] &= region.certain.words[w];
  return region;
}

std::vector<Coord> voxelBricks(const Field& field, const RevoxeliseOptions& options) {
  if (options.restrictToBricks) return {options.bricks.begin(), options.bricks.end()};
  std::vector<Coord> bricks = reachedBricks(field, options.box);
  for (const Coord voxel : options.alwaysActive) {
    if (!options.box.contains(voxel)) continue;
    const Coord corner = voxel - localOf(voxel);
    const auto at = std::ranges::lower_bound(bricks, corner);
    if (at == bricks.end() || *at != corner) bricks.insert(at, corner);
  }
  return bricks;
}

BrickMask settle(const VoxelRule& rule, const BrickRegion& region, std::span<float> values) {
  BrickMask mask;
  for (int v = 0; v < kBrickVoxels; ++v) {
    values[v] = rule.settled(values[v]);
    if (region.isActive(rule, v, values[v]))
      mask.set(v);
    else
      values[v] = rule.inactiveValue(values[v]);
  }
  return mask;
}

namespace {

/// The lowest corner of a box around all bricks.
Coord lowestCorner(std::span<const Coord> corners) {
  constexpr std::int64_t kMaxExtent = std::int64_t{Box::kMax} - kBrickSide;
  Coord low = corners.front();
  for (const Coord c : corners) low = minCoord(low, c);
  for (const Coord c : corners) {
    const auto extent =
        std::max({std::int64_t(c.x) - low.x, std::int64_t(c.y) - low.y, std::int64_t(c.z) - low.z});
    if (extent > kMaxExtent)
      throw RuntimeFailure("the ellipsoids reach the voxels " + toString(low) + " and " +
                           toString(c) + ", which are 2^31 voxels or more apart");
  }
  return low;
}

SparseVolume settledBricks(const Field& field, std::span<const Coord> corners,
                           const RevoxeliseOptions& options) {
  const VoxelRule rule = makeVoxelRule(field.background, options);
  SparseVolume volume;
  volume.background = field.background;
  volume.values = VoxelArray<float>(options.memory);
  if (corners.empty()) return volume;
  volume.origin = lowestCorner(corners);
  std::vector<BrickMask> masks(std::min(kBatchBricks, corners.size()));
  volume.values.reserve(corners.size() * kBrickVoxels);
  forEachBatch(field, corners, [&](const BrickBatch& batch) {
    parallelFor(std::size_t{0}, batch.size(), [&](std::size_t b) {
      masks[b] = settle(rule, regionIn(options, batch.corners[b]), batch.values(b));
    });
    for (std::size_t b = 0; b < batch.size(); ++b) {
      if (masks[b].count() == 0) continue;
      const auto values = batch.values(b);
      volume.bricks.push_back(brickOf(batch.corners[b] - volume.origin));
      volume.active.push_back(masks[b]);
      volume.values.insert(volume.values.end(), values.begin(), values.end());
    }
  });
  dropInactiveBricks(volume);
  return volume;
}

}  // namespace

SparseVolume revoxelise(const Field& field, const RevoxeliseOptions& options) {
  return settledBricks(field, voxelBricks(field, options), options);
}

// ---- Places

namespace {

/// A place may be half a voxel outside the voxels of its brick.
constexpr double kHalfVoxel = 0.5;
/// Places that are sorted by bricks together. More of them fill the blocks better.
constexpr std::size_t kPlacesPerGroup = std::size_t{1} << 18;
constexpr std::size_t kPlacesPerBlock = 256;
static_assert(kPlacesPerBlock % PlaceBlock::kMultiple == 0);

std::int32_t nearestVoxel(double x) {
  const double nearest = std::floor(x + kHalfVoxel);
  if (!(nearest >= double(Box::kMin) && nearest <= double(Box::kMax)))
    throw UsageError("a place to evaluate is not finite or lies outside the index space");
  return std::int32_t(nearest);
}

Coord brickAt(const Place& place) {
  return brickOf({nearestVoxel(place[0]), nearestVoxel(place[1]), nearestVoxel(place[2])});
}

/// Some of the places, sorted by their bricks.
struct PlaceGroup {
  std::vector<Coord> bricks;         ///< each once, in the order in which they first occur
  std::vector<std::uint32_t> begin;  ///< first entry of each brick in `order`, and the end
  std::vector<std::uint32_t> order;  ///< indices of places
};

/// Numbers the bricks of places. \return the number of each place's brick
std::vector<std::uint32_t> numberBricks(std::span<const Place> places, BrickIndex& index) {
  std::vector<std::uint32_t> numbers(places.size());
  for (std::size_t p = 0; p < places.size(); ++p) {
    const Coord brick = brickAt(places[p]);
    numbers[p] = index.find(brick);
    if (numbers[p] != BrickIndex::kNone) continue;
    index.append({&brick, 1});
    numbers[p] = std::uint32_t(index.size() - 1);
  }
  return numbers;
}

PlaceGroup groupOf(std::span<const Place> places) {
  BrickIndex index({});
  const std::vector<std::uint32_t> numbers = numberBricks(places, index);
  PlaceGroup group{index.bricks(), std::vector<std::uint32_t>(index.size() + 1),
                   std::vector<std::uint32_t>(places.size())};
  for (const std::uint32_t number : numbers) ++group.begin[number + 1];
  for (std::size_t b = 0; b < index.size(); ++b) group.begin[b + 1] += group.begin[b];
  std::vector<std::uint32_t> next(group.begin.begin(), group.begin.end() - 1);
  for (std::size_t p = 0; p < places.size(); ++p)
    group.order[next[numbers[p]]++] = std::uint32_t(p);
  return group;
}

/// The index corners of the bricks of all groups, each once and in increasing order.
std::vector<Coord> cornersOf(const std::vector<PlaceGroup>& groups) {
  std::vector<Coord> corners;
  for (const PlaceGroup& group : groups)
    for (const Coord brick : group.bricks) corners.push_back(brick * kBrickSide);
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return corners;
}

std::vector<Coord> bricksOfCorners(std::span<const Coord> corners) {
  std::vector<Coord> bricks;
  for (const Coord corner : corners) bricks.push_back(brickOf(corner));
  return bricks;
}

/// Places of one brick as the kernels need them. Lanes without a place are at the first voxel.
struct PlaceLanes {
  alignas(64) float x[kPlacesPerBlock];
  alignas(64) float y[kPlacesPerBlock];
  alignas(64) float z[kPlacesPerBlock];
  alignas(64) float sum[kPlacesPerBlock];
  int count;

  PlaceLanes(std::span<const Place> places, std::span<const std::uint32_t> which, Coord corner,
             float background) {
    constexpr int kMultiple = PlaceBlock::kMultiple;
    count = (int(which.size()) + kMultiple - 1) / kMultiple * kMultiple;
    for (int i = 0; i < count; ++i) {
      const bool isPlace = std::size_t(i) < which.size();
      const Place place =
          isPlace ? places[which[i]] : Place{double(corner.x), double(corner.y), double(corner.z)};
      x[i] = float(place[0] - corner.x);
      y[i] = float(place[1] - corner.y);
      z[i] = float(place[2] - corner.z);
      sum[i] = background;
    }
  }
  [[nodiscard]] PlaceBlock places() const { return {x, y, z, count}; }
};

class PlaceEvaluator {
 public:
  PlaceEvaluator(const Field& field, std::span<const Coord> corners)
      : field_(gather(field)),
        pairs_(pairsWith(supports(field, kHalfVoxel + kRoundingSlack), corners)),
        index_(bricksOfCorners(corners)),
        background_(field.background) {}

  void evaluate(const PlaceGroup& group, std::span<const Place> places,
                std::span<float> out) const {
    const std::span<const std::uint32_t> order = group.order;
    for (std::size_t b = 0; b < group.bricks.size(); ++b)
      for (std::size_t i = group.begin[b]; i < group.begin[b + 1]; i += kPlacesPerBlock) {
        const auto which =
            order.subspan(i, std::min<std::size_t>(kPlacesPerBlock, group.begin[b + 1] - i));
        PlaceLanes block(places, which, group.bricks[b] * kBrickSide, background_);
        addPairs(group.bricks[b], block);
        for (std::size_t p = 0; p < which.size(); ++p) out[which[p]] = block.sum[p];
      }
  }

 private:
  void addPairs(Coord brick, PlaceLanes& block) const {
    const std::uint32_t b = index_.find(brick);
    for (auto pair = pairs_.brickBegin[b]; pair != pairs_.brickBegin[b + 1]; ++pair) {
      const std::uint32_t i = pairs_.ellipsoid[pair];
      const Coord corner = brick * kBrickSide - field_.origins[field_.chunkOf[i]];
      const float inFrame[3] = {float(corner.x), float(corner.y), float(corner.z)};
      add_(field_.forms[i], inFrame, field_.kernel(i), block.places(), block.sum);
    }
  }

  GatheredField field_;
  BrickPairs pairs_;
  BrickIndex index_;
  float background_;
  AddPlaces add_ = placeKernel();
};

}  // namespace

void evaluatePlaces(const Field& field, std::span<const Place> places, std::span<float> out) {
  const std::size_t groups = (places.size() + kPlacesPerGroup - 1) / kPlacesPerGroup;
  const auto partOf = [&](auto all, std::size_t g) {
    const std::size_t first = g * kPlacesPerGroup;
    return all.subspan(first, std::min(kPlacesPerGroup, all.size() - first));
  };
  std::vector<PlaceGroup> sorted(groups);
  parallelFor(std::size_t(0), groups,
              [&](std::size_t g) { sorted[g] = groupOf(partOf(places, g)); });
  const std::vector<Coord> corners = cornersOf(sorted);
  if (corners.empty()) return;
  const PlaceEvaluator evaluator(field, corners);
  parallelFor(std::size_t(0), groups, [&](std::size_t g) {
    evaluator.evaluate(sorted[g], partOf(places, g), partOf(out, g));
  });
}

// ---- Estimates of work

namespace {

// Bytes that are held at once, at most. Lists that grow hold twice their content while they are
// copied, and a tree that is written holds a brick again. docs/lab-notes.md, "Memory estimates",
// compares an estimate with what a program held.
constexpr double kEvaluationBytesPerEllipsoid = 512.0;  // parameters, support, prepared form
constexpr double kBytesPerPair = 16.0;  // both lists of pairs, and intermediate lists
/// Pairs that are not listed at the same time take time only. They count a little, so that a limit
/// on the memory also limits the time that a hostile file may take.
constexpr double kBytesPerFurtherPair = 1.0;
constexpr double kBytesOfValues = kBrickVoxels * sizeof(float);
/// Bytes that a brick takes without its values.
constexpr double kBytesPerEntry = 2.0 * sizeof(BrickMask) + 96.0;

/// Bytes of an evaluated brick in memory.
double bytesPerBrick(double bricks, const VoxelMemory& memory) {
  const bool isInFile = memory.isInFile(std::uint64_t(std::min(bricks * kBytesOfValues, 0x1p63)));
  return kBytesPerEntry + (isInFile ? 0.0 : 2.0 * kBytesOfValues);
}

/// An upper bound that counts a brick once for each ellipsoid that reaches it.
WorkEstimate boundOf(std::span<const Support> supports, const Box& within, double maxOfAll) {
  WorkEstimate bound{.ellipsoids = double(supports.size())};
  Box all;
  for (const Support& support : supports) {
    const Box range = common(brickRange(support), within);
    if (range.empty()) continue;
    bound.pairs += std::min(maxBricks(support, within), maxOfAll);
    all.expand(range);
  }
  bound.bricks = std::min({bound.pairs, all.volume(), maxOfAll});
  return bound;
}

}  // namespace

double WorkEstimate::bytes(const VoxelMemory& memory) const {
  const double listed = std::min(pairs, std::max(kMaxListedPairs, ellipsoids));
  return ellipsoids * kEvaluationBytesPerEllipsoid + listed * kBytesPerPair +
         (pairs - listed) * kBytesPerFurtherPair + bricks * bytesPerBrick(bricks, memory) +
         std::min(bricks, double(kBatchBricks)) * kBytesOfValues;
}

WorkEstimate estimateWork(const Field& field, const EstimateOptions& options) {
  const auto reach = supports(field);
  const Box within = bricksOf(options.within);
  WorkEstimate estimate = boundOf(reach, within, options.maxBricks);
  WorkEstimate withoutBricks = estimate;
  withoutBricks.bricks = 0.0;
  const double left = options.enough - withoutBricks.bytes();
  if (estimate.bytes(options.memory) <= options.enough || !(left > 0.0)) return estimate;
  const double most = left / bytesPerBrick(estimate.bricks, options.memory);
  const double counted = countBricks(reach, within, most);
  if (counted <= most) estimate.bricks = std::min(estimate.bricks, counted);
  return estimate;
}

}  // namespace esvr
