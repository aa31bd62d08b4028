#include "field/evaluate.h"

#include <algorithm>

#include "core/parallel.h"
#include "esvr/field.h"
#include "field/brick_kernels.h"

namespace esvr {
namespace {

std::array<double, 3> centerOf(const Ellipsoids& e, std::size_t i) {
  return {e.center[0][i], e.center[1][i], e.center[2][i]};
}

bool perEllipsoidKappa(const Field& field) {
  for (const auto& chunk : field.chunks)
    if (!chunk.ellipsoids.kappa.empty()) return true;
  return false;
}

/// Calls visit(number, chunk's number, chunk, index in the chunk) for every ellipsoid, in parallel.
template <class Visit>
void forEachEllipsoid(const Field& field, Visit&& visit) {
  constexpr std::size_t kGrain = 1024;
  std::size_t first = 0;
  for (std::uint32_t c = 0; c < field.chunks.size(); ++c) {
    const Chunk& chunk = field.chunks[c];
    const tbb::blocked_range<std::size_t> all(0, chunk.ellipsoids.size(), kGrain);
    parallelFor(all, [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) visit(first + i, c, chunk, i);
    });
    first += chunk.ellipsoids.size();
  }
}

}  // namespace

GatheredField gather(const Field& field) {
  GatheredField g;
  const std::size_t count = field.ellipsoidCount();
  for (const auto& chunk : field.chunks) g.origins.push_back(chunk.origin);
  const bool several = perEllipsoidKappa(field);
  g.forms.resize(count);
  g.chunkOf.resize(count);
  g.kernels.resize(several ? count : 1, kernelConstants<float>(field.kernel));
  forEachEllipsoid(field, [&](std::size_t n, std::uint32_t c, const Chunk& chunk, std::size_t i) {
    const Ellipsoids& e = chunk.ellipsoids;
    const double kappa = kappaOf(field, e, i);
    const double radius = supportRadius(kernelConstants<double>(field.kernel, kappa));
    g.forms[n] = makeBrickForm(centerOf(e, i), unitFrame(e, i), radius, e.intensity[i]);
    if (several) g.kernels[n] = kernelConstants<float>(field.kernel, kappa);
    g.chunkOf[n] = c;
  });
  return g;
}

std::vector<Support> supports(const Field& field, double slack) {
  std::vector<Support> all(field.ellipsoidCount());
  forEachEllipsoid(field, [&](std::size_t n, std::uint32_t, const Chunk& chunk, std::size_t i) {
    const Ellipsoids& e = chunk.ellipsoids;
    auto center = centerOf(e, i);
    center[0] += chunk.origin.x, center[1] += chunk.origin.y, center[2] += chunk.origin.z;
    const double radius =
        supportRadius(kernelConstants<double>(field.kernel, kappaOf(field, e, i)));
    all[n] = makeSupport(center, unitFrame(e, i), radius, slack);
  });
  return all;
}

std::vector<Coord> reachedBricks(const Field& field, const Box& within) {
  const auto reach = supports(field);
  requireListable(reach, bricksOf(within));
  auto bricks = missingBricks(
      BrickIndex({}), reach.size(), [&](std::size_t i) -> const Support& { return reach[i]; },
      bricksOf(within));
  for (Coord& b : bricks) b = b * kBrickSide;
  return bricks;
}

EvaluatePlan planEvaluation(const Field& field, std::span<const Coord> corners) {
  return {gather(field), pairsWith(supports(field), corners)};
}

void BrickEvaluator::evaluate(std::size_t first, std::span<float> out) const {
  const BrickKernels& kernels = brickKernels();
  const GatheredField& gathered = field_.gathered;
  parallelFor(std::size_t(0), out.size() / kBrickVoxels, [&](std::size_t b) {
    alignas(64) float sum[kBrickVoxels] = {};
    const std::size_t brick = first + b;
    for (auto pair = pairs_.brickBegin[brick]; pair != pairs_.brickBegin[brick + 1]; ++pair) {
      const auto i = pairs_.ellipsoid[pair];
      const auto corner = gathered.fromOrigin(i, corners_[brick]);
      kernels.add(gathered.forms[i], corner.data(), gathered.kernel(i), sum);
    }
    for (std::size_t v = 0; v < kBrickVoxels; ++v)
      out[b * kBrickVoxels + v] = field_.background + sum[v];
  });
}

void evaluateBricks(const Field& field, std::span<const Coord> corners, std::span<float> out) {
  const PreparedField prepared(field);
  BrickEvaluator(prepared, corners).evaluate(0, out);
}

namespace {

/// An upper bound of the number of pairs with these bricks.
double maxPairs(std::span<const Support> reach, std::span<const Coord> corners) {
  using Range = tbb::blocked_range<std::size_t>;
  Box bounds;
  for (const Coord corner : corners) bounds.expand(brickOf(corner));
  const double bricks = double(corners.size());
  return parallelDeterministicReduce(
      Range(0, reach.size(), 4096), 0.0,
      [&](const Range& range, double sum) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          sum += std::min(maxBricks(reach[i], bounds), bricks);
        return sum;
      },
      std::plus<>());
}

class Batches {
 public:
  Batches(const Field& field, std::size_t bricks, const BatchVisitor& visit, double maxListed)
      : field_(field),
        values_(std::min(kBatchBricks, bricks) * kBrickVoxels),
        visit_(visit),
        maxListed_(maxListed) {}

  /// Halves the bricks until their pairs can be listed.
  void visit(std::span<const Coord> corners) {
    if (corners.size() > 1 && maxPairs(field_.reach, corners) > maxListed_) {
      visit(corners.first(corners.size() / 2));
      return visit(corners.subspan(corners.size() / 2));
    }
    const BrickEvaluator evaluator(field_, corners);
    for (std::size_t first = 0; first < corners.size(); first += kBatchBricks) {
      const auto batch = corners.subspan(first, std::min(kBatchBricks, corners.size() - first));
      const auto sums = std::span(values_).first(batch.size() * kBrickVoxels);
      evaluator.evaluate(first, sums);
      visit_({batch, sums});
    }
  }

 private:
  PreparedField field_;
  std::vector<float> values_;
  const BatchVisitor& visit_;
  double maxListed_;
};

}  // namespace

void forEachBatch(const Field& field, std::span<const Coord> corners, const BatchVisitor& visit,
                  double maxListed) {
  if (!corners.empty()) Batches(field, corners.size(), visit, maxListed).visit(corners);
}

namespace {

/// Adds 1 to every voxel of a brick that lies in an ellipsoid's support.
void addHits(const LineForm& f, const std::array<float, 3>& corner, float cutoff,
             std::array<std::uint32_t, kBrickVoxels>& counts) {
  const float cx = f.center[0] - corner[0], cy = f.center[1] - corner[1],
              cz = f.center[2] - corner[2];
  for (int x = 0; x < kBrickSide; ++x)
    for (int z = 0; z < kBrickSide; ++z) {
      const float dx = float(x) - cx, dz = float(z) - cz;
      const float pz[3] = {f.pz[0] * dz, f.pz[1] * dz, f.pz[2] * dz};
      const float closest = closestSquared(f, dx, pz);
      if (!(closest < cutoff)) continue;
      for (int y = 0; y < kBrickSide; ++y)
        if (squaredAt(f, closest, distanceAlong(f, float(y), cy, dx, dz)) < cutoff)
          ++counts[std::size_t(voxelOffset({x, y, z}))];
    }
}

}  // namespace

double averageHits(const Field& field) {
  struct Hits {
    std::uint64_t pairs = 0;   // pairs of an ellipsoid and a voxel in its support
    std::uint64_t voxels = 0;  // voxels that lie in at least one support
  };
  const std::vector<Coord> corners = reachedBricks(field);
  const EvaluatePlan plan = planEvaluation(field, corners);
  const GatheredField& gathered = plan.field;
  const BrickPairs& pairs = plan.pairs;
  std::vector<Hits> hits(corners.size());
  parallelFor(std::size_t(0), corners.size(), [&](std::size_t b) {
    std::array<std::uint32_t, kBrickVoxels> counts{};
    for (auto pair = pairs.brickBegin[b]; pair != pairs.brickBegin[b + 1]; ++pair) {
      const std::size_t i = pairs.ellipsoid[pair];
      addHits(gathered.forms[i], gathered.fromOrigin(i, corners[b]), gathered.kernel(i).cutoff,
              counts);
    }
    for (const std::uint32_t count : counts) {
      hits[b].pairs += count;
      hits[b].voxels += count > 0 ? 1 : 0;
    }
  });
  Hits total;
  for (const Hits& h : hits) total.pairs += h.pairs, total.voxels += h.voxels;
  return total.voxels > 0 ? double(total.pairs) / double(total.voxels) : 0.0;
}

double evaluateReference(const Field& field, Coord voxel) {
  double value = field.background;
  for (const Chunk& chunk : field.chunks) {
    const Ellipsoids& e = chunk.ellipsoids;
    for (std::size_t i = 0; i < e.size(); ++i) {
      const double d[3] = {double(voxel.x) - chunk.origin.x - e.center[0][i],
                           double(voxel.y) - chunk.origin.y - e.center[1][i],
                           double(voxel.z) - chunk.origin.z - e.center[2][i]};
      const auto k = kernelConstants<double>(field.kernel, kappaOf(field, e, i));
      const Matrix3 L = unitFrame(e, i);
      double m = 0.0;  // |L d|^2
      for (int r = 0; r < 3; ++r) {
        const double u = L[3 * r] * d[0] + L[3 * r + 1] * d[1] + L[3 * r + 2] * d[2];
        m += u * u;
      }
      value += double(e.intensity[i]) * kernelPhi(k, m);
    }
  }
  return value;
}

}  // namespace esvr
