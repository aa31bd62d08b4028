#include "support/stability.h"

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

double ReferenceField::bound(const ReferenceBrick& brick, int voxel, DeviceKind device) const {
  constexpr double kSmallestOfCpu = 0x1p-149, kSmallestNormal = 0x1p-126, kUnitOfSum = 0x1p-29;
  const VoxelTerms& terms = brick.voxels[std::size_t(voxel)];
  const double count = double(brick.ellipsoids);
  const double ofSum = rounding::kUnit * ((terms.count + rounding::kOfTerm) * terms.magnitudes +
                                          std::abs(double(field_.background)));
  if (device == DeviceKind::kCpu) return terms.errors + ofSum + count * kSmallestOfCpu;
  const double ofUnits = terms.count * count * brick.largestIntensity * kUnitOfSum;
  return terms.errors + ofSum + ofUnits + count * kSmallestNormal;
}

void evaluateBricksOn(const Device& device, const Field& field, std::span<const Coord> corners,
                      std::span<float> out) {
  if (device.kind == DeviceKind::kCuda)
    cuda::decodeBricks(device, field, corners, out);
  else
    evaluateBricks(field, corners, out);
}

// The bricks that are compared.

namespace {

double longestScale(const Ellipsoids& e, std::size_t i) {
  return std::exp(double(std::max({e.logScale[0][i], e.logScale[1][i], e.logScale[2][i]})));
}
double shortestScale(const Ellipsoids& e, std::size_t i) {
  return std::exp(double(std::min({e.logScale[0][i], e.logScale[1][i], e.logScale[2][i]})));
}
double aspectOf(const Ellipsoids& e, std::size_t i) {
  return longestScale(e, i) / shortestScale(e, i);
}

/// The corner of the brick in which the ellipsoid is centered of which a figure is the largest.
template <class Figure>
Coord brickOfLargest(const Field& field, const Figure& figure) {
  double largest = -std::numeric_limits<double>::infinity();
  Coord corner{};
  for (const Chunk& chunk : field.chunks)
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i) {
      const double own = figure(chunk.ellipsoids, i);
      if (own <= largest) continue;
      largest = own;
      const auto along = [&](std::size_t axis, std::int32_t origin) {
        return placeAlong(std::round(double(origin) + double(chunk.ellipsoids.center[axis][i])));
      };
      corner =
          brickOf({along(0, chunk.origin.x), along(1, chunk.origin.y), along(2, chunk.origin.z)});
    }
  return corner * kBrickSide;
}

/// Bricks of a list that are spread evenly over it, and those of the extreme ellipsoids, increasing.
std::vector<Coord> samplesOf(const Field& field, const std::vector<Coord>& bricks,
                             std::size_t count) {
  count = std::min(count, bricks.size());
  std::vector<Coord> samples;
  for (std::size_t n = 0; n < count; ++n)
    samples.push_back(bricks[(2 * n + 1) * bricks.size() / (2 * count)]);
  using E = const Ellipsoids&;
  for (const Coord corner :
       {brickOfLargest(field, [](E e, std::size_t i) { return -shortestScale(e, i); }),
        brickOfLargest(field, longestScale), brickOfLargest(field, aspectOf),
        brickOfLargest(field, [](E e, std::size_t i) { return std::abs(double(e.intensity[i])); })})
    if (std::ranges::binary_search(bricks, corner)) samples.push_back(corner);
  std::ranges::sort(samples);
  samples.erase(std::unique(samples.begin(), samples.end()), samples.end());
  return samples;
}

/// The figures of some voxels, and the sums from which those of a field follow.
struct BrickFigures {
  Stability figures;
  double squares = 0.0;                 ///< of the differences
  double magnitudes = 0.0, sums = 0.0;  ///< of the terms, and of the magnitudes of their sums
};

/// \param values  of the voxels of the brick in float32
BrickFigures compare(const ReferenceField& reference, float background, Coord corner,
                     const float* values, DeviceKind device) {
  BrickFigures all;
  Stability& s = all.figures;
  s.at = corner;
  const ReferenceBrick brick = reference.evaluate(corner);
  for (int v = 0; v < kBrickVoxels; ++v) {
    const VoxelTerms& terms = brick.voxels[std::size_t(v)];
    const double difference = std::isfinite(values[v])
                                  ? std::abs(values[v] - (double(background) + terms.sum))
                                  : std::numeric_limits<double>::infinity();
    const double bound = reference.bound(brick, v, device);
    if (difference > s.largest) s.largest = difference, s.at = corner + voxelLocal(v);
    if (difference > 0.0) s.shareOfBound = std::max(s.shareOfBound, difference / bound);
    s.bound = std::max(s.bound, bound);
    s.peak = std::max(s.peak, std::abs(terms.sum));
    s.largestOverlap = std::max(s.largestOverlap, terms.count);
    all.squares += difference * difference;
    all.magnitudes += terms.magnitudes;
    all.sums += std::abs(terms.sum);
  }
  return all;
}

}  // namespace

Stability measureStability(const Field& field, const StabilityOptions& options) {
  const std::vector<Coord> samples = samplesOf(field, reachedBricks(field), options.samples);
  std::vector<float> values(samples.size() * kBrickVoxels);
  if (options.evaluate)
    options.evaluate(field, samples, values);
  else
    evaluateBricksOn(options.device, field, samples, values);

  const ReferenceField reference(field);
  std::vector<BrickFigures> bricks(samples.size());
  parallelFor(std::size_t{0}, samples.size(), [&](std::size_t b) {
    bricks[b] = compare(reference, field.background, samples[b], &values[b * kBrickVoxels],
                        options.device.kind);
  });
  Stability all;
  all.sampled = samples.size();
  double squares = 0.0, magnitudes = 0.0, sums = 0.0;
  for (const BrickFigures& b : bricks) {
    const Stability& s = b.figures;
    if (s.largest > all.largest) all.largest = s.largest, all.at = s.at;
    all.bound = std::max(all.bound, s.bound);
    all.shareOfBound = std::max(all.shareOfBound, s.shareOfBound);
    all.peak = std::max(all.peak, s.peak);
    all.largestOverlap = std::max(all.largestOverlap, s.largestOverlap);
    squares += b.squares, magnitudes += b.magnitudes, sums += b.sums;
  }
  if (!bricks.empty()) all.rms = std::sqrt(squares / double(values.size()));
  if (sums > 0.0) all.cancellation = magnitudes / sums;
  for (const Chunk& chunk : field.chunks)
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i)
      all.largestCondition =
          std::max(all.largestCondition, std::pow(aspectOf(chunk.ellipsoids, i), 2));
  return all;
}

}  // namespace esvr::test
