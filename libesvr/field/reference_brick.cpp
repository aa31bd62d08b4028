#include "field/reference_brick.h"

#include <algorithm>
#include <cmath>

#include "field/gather.h"
#include "field/rounding_bound.h"

namespace esvr {
namespace {

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
        kernel(kernelConstants<double>(field.kernel, chunk.ellipsoids.kappa.empty()
                                                         ? double(field.kernel.kappa)
                                                         : double(chunk.ellipsoids.kappa[i]))),
        intensity(chunk.ellipsoids.intensity[i]) {}

  void addTo(VoxelTerms& terms, Coord voxel) const {
    const double d[3] = {double(voxel.x) - origin.x - center[0],
                         double(voxel.y) - origin.y - center[1],
                         double(voxel.z) - origin.z - center[2]};
    double m = 0.0;
    for (int r = 0; r < 3; ++r) {
      const double u = L[3 * r] * d[0] + L[3 * r + 1] * d[1] + L[3 * r + 2] * d[2];
      m += u * u;
    }
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

bool overlap(const Box& a, const Box& b) { return !common(a, b).empty(); }

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
      if (!overlap(boxes_[number++], voxels)) continue;
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

}  // namespace esvr
