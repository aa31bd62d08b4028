#include "support/stability.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/parallel.h"
#include "field/evaluate.h"
#include "render/cuda/cuda_renderers.h"

namespace esvr::test {
namespace {

/// |L d|^2
double squaredLength(const Matrix3& L, const double (&d)[3]) {
  double m = 0.0;
  for (int r = 0; r < 3; ++r) {
    const double u = L[3 * r] * d[0] + L[3 * r + 1] * d[1] + L[3 * r + 2] * d[2];
    m += u * u;
  }
  return m;
}

/// A number of voxels along an axis, rounded away from the middle of an interval and limited to the
/// index space.
std::int32_t placeAlong(double at) {
  return std::int32_t(std::clamp(at, double(Box::kMin), double(Box::kMax)));
}

/// The voxels of the bounding box of a support.
Box boxOf(const Support& s) {
  const auto low = [&](std::size_t a) { return placeAlong(std::floor(s.center[a] - s.half[a])); };
  const auto high = [&](std::size_t a) { return placeAlong(std::ceil(s.center[a] + s.half[a])); };
  return {{low(0), low(1), low(2)}, {high(0), high(1), high(2)}};
}

/// An ellipsoid in float64.
struct ReferenceEllipsoid {
  ReferenceEllipsoid(const Field& field, const Chunk& chunk, std::size_t i)
      : origin(chunk.origin),
        center{chunk.ellipsoids.center[0][i], chunk.ellipsoids.center[1][i],
               chunk.ellipsoids.center[2][i]},
        L(unitFrame(chunk.ellipsoids, i)),
        columns(rounding::columnLengths(L)),
        kernel(kernelConstants<double>(field.kernel, kappaOf(field, chunk.ellipsoids, i))),
        intensity(chunk.ellipsoids.intensity[i]) {}

  void addTo(VoxelTerms& terms, Coord voxel) const {
    const double d[3] = {double(voxel.x) - origin.x - center[0],
                         double(voxel.y) - origin.y - center[1],
                         double(voxel.z) - origin.z - center[2]};
    const double m = squaredLength(L, d);
    const double term = intensity * kernelPhi(kernel, m);
    terms.sum += term;
    terms.magnitudes += std::abs(term);
    terms.errors += std::abs(intensity) * rounding::ofPhi(kernel, m, rounding::ofM(columns, d, m));
    terms.count += m < kernel.cutoff ? 1u : 0u;
  }

  Coord origin;
  std::array<double, 3> center;
  Matrix3 L;
  rounding::ColumnLengths columns;
  KernelConstants<double> kernel;
  double intensity;
};

}  // namespace

ReferenceField::ReferenceField(const Field& field) : field_(field) {
  for (const Support& support : supports(field)) boxes_.push_back(boxOf(support));
}

ReferenceBrick ReferenceField::evaluate(Coord corner) const {
  constexpr std::int32_t kLast = kBrickSide - 1;
  const Box voxels{corner, corner + Coord{kLast, kLast, kLast}};
  ReferenceBrick brick{};
  std::size_t number = 0;
  for (const Chunk& chunk : field_.chunks)
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i) {
      if (common(boxes_[number++], voxels).empty()) continue;
      const ReferenceEllipsoid ellipsoid(field_, chunk, i);
      ++brick.ellipsoids;
      brick.largestIntensity = std::max(brick.largestIntensity, std::abs(ellipsoid.intensity));
      for (int v = 0; v < kBrickVoxels; ++v)
        ellipsoid.addTo(brick.voxels[std::size_t(v)], corner + voxelLocal(v));
    }
  return brick;
}

double ReferenceField::bound(const ReferenceBrick& brick, int voxel,
                             const Arithmetic& arithmetic) const {
  constexpr double kSmallestOfCpu = 0x1p-149, kSmallestNormal = 0x1p-126, kUnitOfSum = 0x1p-29;
  const VoxelTerms& terms = brick.voxels[std::size_t(voxel)];
  const double count = double(brick.ellipsoids);
  const double ofSum = rounding::kUnit * ((terms.count + rounding::kOfTerm) * terms.magnitudes +
                                          std::abs(double(field_.background)));
  const double smallest = arithmetic.integerSums ? kSmallestNormal : kSmallestOfCpu;
  const double ofUnits =
      arithmetic.integerSums ? terms.count * count * brick.largestIntensity * kUnitOfSum : 0.0;
  return terms.errors + ofSum + ofUnits + count * smallest;
}

// The ellipsoids that are most difficult to evaluate.

namespace {

/// The figures of one ellipsoid.
struct EllipsoidFigures {
  double smallest, largest, aspect, intensity, kappa;
};

EllipsoidFigures figuresOf(const Field& field, const Ellipsoids& e, std::size_t i) {
  const auto [low, high] = std::minmax({e.logScale[0][i], e.logScale[1][i], e.logScale[2][i]});
  return {std::exp(double(low)), std::exp(double(high)), std::exp(double(high) - double(low)),
          std::abs(double(e.intensity[i])), kappaOf(field, e, i)};
}

/// Calls visit(figures, chunk, index in the chunk) for every ellipsoid.
template <class Visit>
void forEachFigures(const Field& field, Visit&& visit) {
  for (const Chunk& chunk : field.chunks)
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i)
      visit(figuresOf(field, chunk.ellipsoids, i), chunk, i);
}

/// The place of an ellipsoid, and the figure by which it was chosen.
struct Extreme {
  double figure = 0.0;
  const Chunk* chunk = nullptr;
  std::size_t index = 0;

  void replaceIfBelow(double other, const Chunk& by, std::size_t i) {
    if (chunk == nullptr || other > figure) *this = {other, &by, i};
  }
  [[nodiscard]] Coord center() const {
    const auto along = [&](std::size_t a, std::int32_t origin) {
      const double at = std::round(double(origin) + double(chunk->ellipsoids.center[a][index]));
      return std::int32_t(std::clamp(at, double(Box::kMin), double(Box::kMax)));
    };
    return {along(0, chunk->origin.x), along(1, chunk->origin.y), along(2, chunk->origin.z)};
  }
};

}  // namespace

FieldExtremes extremesOf(const Field& field) {
  FieldExtremes all;
  bool first = true;
  forEachFigures(field, [&](const EllipsoidFigures& f, const Chunk&, std::size_t) {
    const auto lower = [&](double& value, double by) { value = first ? by : std::min(value, by); };
    const auto raise = [&](double& value, double by) { value = first ? by : std::max(value, by); };
    lower(all.smallestScale, f.smallest), raise(all.largestScale, f.largest);
    raise(all.largestAspect, f.aspect);
    lower(all.lowestKappa, f.kappa), raise(all.highestKappa, f.kappa);
    lower(all.smallestIntensity, f.intensity), raise(all.largestIntensity, f.intensity);
    first = false;
  });
  all.largestCondition = all.largestAspect * all.largestAspect;
  return all;
}

std::vector<Coord> centersOfExtremes(const Field& field) {
  Extreme smallest, largest, aspect, intensity;
  forEachFigures(field, [&](const EllipsoidFigures& f, const Chunk& chunk, std::size_t i) {
    smallest.replaceIfBelow(-f.smallest, chunk, i);
    largest.replaceIfBelow(f.largest, chunk, i);
    aspect.replaceIfBelow(f.aspect, chunk, i);
    intensity.replaceIfBelow(f.intensity, chunk, i);
  });
  std::vector<Coord> centers;
  for (const Extreme& c : {smallest, largest, aspect, intensity})
    if (c.chunk != nullptr) centers.push_back(c.center());
  return centers;
}

// The comparison.

void evaluateBricksOn(const Device& device, const Field& field, std::span<const Coord> corners,
                      std::span<float> out) {
  if (device.kind == DeviceKind::kCuda)
    cuda::decodeBricks(device, field, corners, out);
  else
    evaluateBricks(field, corners, out);
}

Arithmetic arithmeticOf(const Device& device) {
  return {.integerSums = device.kind == DeviceKind::kCuda};
}

namespace {

/// Sums over voxels from which the figures of a field follow.
struct BrickFigures {
  BrickDifference difference;
  double magnitudes = 0.0, sums = 0.0;  ///< of the terms, and of the magnitudes of their sums
  double peak = 0.0;
  double hits = 0.0, voxelsHit = 0.0;
  std::uint32_t largestOverlap = 0;
};

/// A field, and the comparison of its evaluations.
class FieldComparison {
 public:
  FieldComparison(const Field& field, const StabilityOptions& options)
      : field_(field), options_(options), reference_(field) {}

  [[nodiscard]] BrickFigures compare(Coord corner, const ReferenceBrick& brick,
                                     const float* values) const {
    BrickFigures figures;
    figures.difference.corner = figures.difference.at = corner;
    for (int v = 0; v < kBrickVoxels; ++v) {
      addTerms(figures, brick.voxels[std::size_t(v)]);
      addDifference(figures.difference, brick, v, values[v]);
    }
    return figures;
  }
  [[nodiscard]] ReferenceBrick reference(Coord corner) const { return reference_.evaluate(corner); }

 private:
  static void addTerms(BrickFigures& figures, const VoxelTerms& terms) {
    figures.magnitudes += terms.magnitudes;
    figures.sums += std::abs(terms.sum);
    figures.peak = std::max(figures.peak, std::abs(terms.sum));
    figures.hits += terms.count;
    figures.voxelsHit += terms.count > 0 ? 1.0 : 0.0;
    figures.largestOverlap = std::max(figures.largestOverlap, terms.count);
  }

  [[nodiscard]] double clamped(double value) const {
    if (!options_.range) return value;
    return std::clamp(value, double(options_.range->min), double(options_.range->max));
  }

  void addDifference(BrickDifference& all, const ReferenceBrick& brick, int v, float value) const {
    const double expected = double(field_.background) + brick.voxels[std::size_t(v)].sum;
    const double difference = std::isfinite(value) ? std::abs(clamped(value) - clamped(expected))
                                                   : std::numeric_limits<double>::infinity();
    const double bound = reference_.bound(brick, v, options_.arithmetic);
    all.squares += difference * difference;
    all.bound = std::max(all.bound, bound);
    if (difference > 0.0) all.shareOfBound = std::max(all.shareOfBound, difference / bound);
    if (difference <= all.largest) return;
    all.largest = difference;
    all.at = all.corner + voxelLocal(v);
  }

  const Field& field_;
  const StabilityOptions& options_;
  ReferenceField reference_;
};

/// `count` elements of a list, spread evenly over it.
std::vector<Coord> spreadOver(std::span<const Coord> bricks, std::size_t count) {
  count = std::min(count, bricks.size());
  std::vector<Coord> chosen;
  for (std::size_t n = 0; n < count; ++n)
    chosen.push_back(bricks[(2 * n + 1) * bricks.size() / (2 * count)]);
  return chosen;
}

/// The bricks that are compared, increasing.
std::vector<Coord> samplesOf(const Field& field, std::span<const Coord> bricks, std::size_t count) {
  std::vector<Coord> samples = spreadOver(bricks, count);
  for (const Coord voxel : centersOfExtremes(field)) {
    const Coord corner = brickOf(voxel) * kBrickSide;
    if (std::ranges::binary_search(bricks, corner)) samples.push_back(corner);
  }
  std::ranges::sort(samples);
  samples.erase(std::unique(samples.begin(), samples.end()), samples.end());
  return samples;
}

/// The largest cancellation of a voxel whose sum is not small.
double largestCancellation(const ReferenceBrick& brick, double peak) {
  constexpr double kSmallSum = 0.01;
  double largest = 1.0;
  for (const VoxelTerms& terms : brick.voxels)
    if (terms.sum != 0.0 && std::abs(terms.sum) >= kSmallSum * peak)
      largest = std::max(largest, terms.magnitudes / std::abs(terms.sum));
  return largest;
}

void summarise(const std::vector<BrickFigures>& figures, Stability& result) {
  double squares = 0.0, magnitudes = 0.0, sums = 0.0, hits = 0.0, voxelsHit = 0.0;
  for (const BrickFigures& f : figures) {
    result.largest = std::max(result.largest, f.difference.largest);
    result.bound = std::max(result.bound, f.difference.bound);
    result.shareOfBound = std::max(result.shareOfBound, f.difference.shareOfBound);
    result.peak = std::max(result.peak, f.peak);
    result.largestOverlap = std::max(result.largestOverlap, f.largestOverlap);
    squares += f.difference.squares;
    magnitudes += f.magnitudes, sums += f.sums;
    hits += f.hits, voxelsHit += f.voxelsHit;
  }
  result.sampled = figures.size();
  if (!figures.empty()) result.rms = std::sqrt(squares / double(figures.size() * kBrickVoxels));
  if (sums > 0.0) result.meanCancellation = magnitudes / sums;
  if (voxelsHit > 0.0) result.meanOverlap = hits / voxelsHit;
}

/// The bricks of the largest differences.
std::vector<BrickDifference> worstOf(const std::vector<BrickFigures>& figures, std::size_t count) {
  std::vector<BrickDifference> all;
  for (const BrickFigures& f : figures) all.push_back(f.difference);
  std::ranges::stable_sort(all, std::ranges::greater{}, &BrickDifference::largest);
  all.resize(std::min(all.size(), count));
  return all;
}

}  // namespace

Stability measureStability(const Field& field, const StabilityOptions& options) {
  std::vector<Coord> reached;
  std::span<const Coord> bricks = options.bricks;
  if (bricks.empty()) bricks = reached = reachedBricks(field, options.within);
  const std::vector<Coord> samples = samplesOf(field, bricks, options.samples);

  std::vector<float> values(samples.size() * kBrickVoxels);
  (options.evaluate ? options.evaluate : EvaluateBricks(evaluateBricks))(field, samples, values);

  Stability result;
  result.extremes = extremesOf(field);
  result.bricks = bricks.size();
  const FieldComparison comparison(field, options);
  std::vector<ReferenceBrick> references(samples.size());
  std::vector<BrickFigures> figures(samples.size());
  parallelFor(std::size_t{0}, samples.size(), [&](std::size_t b) {
    references[b] = comparison.reference(samples[b]);
    figures[b] = comparison.compare(samples[b], references[b], &values[b * kBrickVoxels]);
  });
  summarise(figures, result);
  for (const ReferenceBrick& brick : references)
    result.largestCancellation =
        std::max(result.largestCancellation, largestCancellation(brick, result.peak));
  result.worst = worstOf(figures, options.worst);
  return result;
}

int correctDigits(double difference, double peak) {
  constexpr int kMost = std::numeric_limits<double>::max_digits10;
  if (difference == 0.0) return kMost;
  const double share = difference / peak;
  if (!(share < 1.0)) return 0;
  return std::min(kMost, int(std::floor(-std::log10(share))));
}

}  // namespace esvr::test
