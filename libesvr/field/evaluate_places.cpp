/// The evaluation of a field at any places. They are sorted by bricks in groups, and the places of a brick
/// are evaluated in blocks that fill the registers.

#include <algorithm>
#include <cmath>

#include "core/brick_index.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "field/brick_kernels.h"
#include "field/evaluate.h"

namespace esvr {
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

}  // namespace esvr
