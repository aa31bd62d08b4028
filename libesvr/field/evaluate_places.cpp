#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "core/brick_index.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "field/evaluate_plan.h"
#include "field/line_math.h"

namespace esvr {
namespace {

/// A place may be half a voxel outside the voxels of its brick.
constexpr double kHalfVoxel = 0.5;
constexpr std::size_t kPlacesPerTask = 1024;

std::int32_t nearestVoxel(double x) {
  const double nearest = std::floor(x + kHalfVoxel);
  if (!(nearest >= double(Box::kMin) && nearest <= double(Box::kMax)))
    throw UsageError("a place to evaluate is not finite or lies outside the index space");
  return std::int32_t(nearest);
}

Coord brickAt(const Place& place) {
  return brickOf({nearestVoxel(place[0]), nearestVoxel(place[1]), nearestVoxel(place[2])});
}

/// The bricks of places, each once and in increasing order.
std::vector<Coord> cornersOf(std::span<const Place> places) {
  std::vector<Coord> corners;
  for (const Place& place : places) {
    const Coord corner = brickAt(place) * kBrickSide;
    if (corners.empty() || corners.back() != corner) corners.push_back(corner);
  }
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return corners;
}

std::vector<Coord> bricksOfCorners(std::span<const Coord> corners) {
  std::vector<Coord> bricks;
  for (const Coord corner : corners) bricks.push_back(brickOf(corner));
  return bricks;
}

class PlaceEvaluator {
 public:
  PlaceEvaluator(const Field& field, std::span<const Coord> corners)
      : field_(gather(field)),
        pairs_(pairsWith(supports(field, kHalfVoxel + kRoundingSlack), corners)),
        index_(bricksOfCorners(corners)),
        background_(field.background) {}

  [[nodiscard]] float operator()(const Place& place) const {
    const std::uint32_t brick = index_.find(brickAt(place));
    float sum = 0.0f;
    for (auto pair = pairs_.brickBegin[brick]; pair != pairs_.brickBegin[brick + 1]; ++pair)
      sum += valueOf(pairs_.ellipsoid[pair], place);
    return background_ + sum;
  }

 private:
  [[nodiscard]] float valueOf(std::size_t i, const Place& place) const {
    const LineForm& f = field_.forms[i];
    const Coord origin = field_.origins[field_.chunkOf[i]];
    const float dx = float(place[0] - origin.x - double(f.center[0])),
                dy = float(place[1] - origin.y - double(f.center[1])),
                dz = float(place[2] - origin.z - double(f.center[2]));
    const float pz[3] = {f.pz[0] * dz, f.pz[1] * dz, f.pz[2] * dz};
    const float t = distanceAlong(f, dy, 0.0f, dx, dz);
    return f.intensity * kernelPhi(field_.kernel(i), squaredAt(f, closestSquared(f, dx, pz), t));
  }

  GatheredField field_;
  BrickPairs pairs_;
  BrickIndex index_;
  float background_;
};

}  // namespace

void evaluatePlaces(const Field& field, std::span<const Place> places, std::span<float> out) {
  const std::vector<Coord> corners = cornersOf(places);
  if (corners.empty()) return;
  const PlaceEvaluator valueAt(field, corners);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, places.size(), kPlacesPerTask),
                    [&](const auto& range) {
                      for (std::size_t p = range.begin(); p != range.end(); ++p)
                        out[p] = valueAt(places[p]);
                    });
}

}  // namespace esvr
