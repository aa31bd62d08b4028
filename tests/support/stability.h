#pragma once
/// How precisely fields are evaluated in float32, and what makes their evaluation difficult: the definition in float64,
/// the bound of the rounding, which docs/math.md, "Rounding", derives, and the comparison of both on bricks of a field.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "esvr/field.h"
#include "esvr/volume.h"
#include "field/line_form.h"

/// docs/math.md, "Rounding", counts the operations from which the constants follow.
namespace esvr::test::rounding {

inline constexpr double kUnit = 0x1p-24;  ///< largest relative error of one operation

/// The number of roundings, each of one unit, in the parts of an evaluation.
inline constexpr double kOfPosition = 24.0, kOfSquare = 8.0, kOfExponent = 4.0, kOfQuotient = 14.0,
                        kOfTerm = 2.0;
/// Voxels between a voxel and the frame of its brick, or of the first row.
inline constexpr double kFrame = 8.0;

/// The lengths of the columns of L, by which the components of a displacement are multiplied.
struct ColumnLengths {
  double x, y, z;
};
[[nodiscard]] inline ColumnLengths columnLengths(const Matrix3& L) {
  const auto length = [&](int c) { return std::hypot(L[c], L[3 + c], L[6 + c]); };
  return {length(0), length(1), length(2)};
}

/// Bound of the error of m. \param d  displacement of the voxel from the center
[[nodiscard]] inline double ofM(const ColumnLengths& columns, const double (&d)[3], double m) {
  const double products = columns.x * (std::abs(d[0]) + kFrame) +
                          columns.y * (std::abs(d[1]) + kFrame) +
                          columns.z * (std::abs(d[2]) + kFrame);
  const double ofU = kOfPosition * kUnit * products;
  return 2.0 * std::sqrt(m) * ofU + ofU * ofU + kOfSquare * kUnit * m;
}

/// |phi'| of the continuous form, inside and outside of the support. \param m  not negative
[[nodiscard]] inline double slopeAt(const KernelConstants<double>& k, double m) {
  const double quotient = k.numerator / (k.plateau + std::exp(m - k.shift));
  return quotient * (1.0 - quotient * k.slope);
}

/// The largest |phi'| between two values of m. It is largest at m = kappa, where e^(m - s) = B.
[[nodiscard]] inline double steepest(const KernelConstants<double>& k, double from, double to) {
  const double kappa = k.shift + std::log(k.plateau);
  const double ends = std::max(slopeAt(k, from), slopeAt(k, to));
  return from < kappa && kappa < to ? std::max(ends, slopeAt(k, kappa)) : ends;
}

/// Bound of the error of phi. \param ofM  bound of the error of m
[[nodiscard]] inline double ofPhi(const KernelConstants<double>& k, double m, double ofM) {
  const double error = ofM + kUnit * (k.shift + kOfExponent * std::abs(m - k.shift));
  if (m > k.cutoff + error) return 0.0;  // outside the support in either arithmetic
  const double from = std::max(m - error, 0.0), to = std::min(m + error, k.cutoff + error);
  const double phi = kernelPhi(k, m);
  // The paper's kernel jumps where the support ends.
  const double jump = m + error < k.cutoff ? 0.0 : kernelPhi(k, std::nextafter(k.cutoff, 0.0));
  return steepest(k, from, to) * error + kOfQuotient * kUnit * (phi + k.base) + jump;
}

}  // namespace esvr::test::rounding

namespace esvr::test {

// ---- The definition

/// The terms of V - background at a voxel.
struct VoxelTerms {
  double sum = 0.0, magnitudes = 0.0;  ///< the sum of the terms, and of their magnitudes
  double errors = 0.0;                 ///< bound of the sum of their errors
  std::uint32_t count = 0;             ///< ellipsoids whose support contains the voxel
};

struct ReferenceBrick {
  std::array<VoxelTerms, kBrickVoxels> voxels;  ///< in voxelOffset order
  std::uint32_t ellipsoids = 0;                 ///< whose bounding box meets the brick
  double largestIntensity = 0.0;                ///< magnitude, of these ellipsoids
};

/// A field that is evaluated in float64. Its chunks must outlive it.
class ReferenceField {
 public:
  explicit ReferenceField(const Field& field);

  /// \param corner  index corner of a brick
  [[nodiscard]] ReferenceBrick evaluate(Coord corner) const;

  /// Bound of the difference of V in float32 at a voxel from its value in float64. The decoder on a GPU sums integers
  /// in units of a part of the brick's largest intensity, and takes numbers below the normal ones of float32 as 0.
  [[nodiscard]] double bound(const ReferenceBrick& brick, int voxel, DeviceKind device) const;

 private:
  const Field& field_;
  std::vector<Box> boxes_;  ///< bounding boxes of the supports, index coordinates
};

// ---- The comparison

/// Evaluates bricks in float32. The arguments are those of evaluateBricks().
using EvaluateBricks =
    std::function<void(const Field& field, std::span<const Coord> corners, std::span<float> out)>;

/// Evaluates V at all voxels of bricks as the device does: on the CPU with evaluateBricks(), by which files become
/// voxels, and on a GPU with the decoder of the renderers.
/// \throws DeviceError  the device does not exist, the build has no CUDA, or memory is exhausted
void evaluateBricksOn(const Device& device, const Field& field, std::span<const Coord> corners,
                      std::span<float> out);

struct StabilityOptions {
  std::size_t samples = 256;  ///< bricks that are compared, at least 1
  Device device{};
  EvaluateBricks evaluate{};  ///< empty: evaluateBricksOn() the device
};

struct Stability {
  std::size_t sampled = 0;          ///< bricks that were compared
  double largest = 0.0, rms = 0.0;  ///< differences, value units; infinite if a value is not finite
  Coord at;                         ///< voxel of the largest difference
  double bound = 0.0, shareOfBound = 0.0;  ///< the largest of the voxels
  double peak = 0.0;                       ///< largest |V - background| of the sampled voxels
  double largestCondition = 0.0;           ///< condition number of Sigma
  std::uint32_t largestOverlap = 0;        ///< ellipsoids whose support contains a voxel
  /// The sum of the magnitudes of the terms of V - background over all voxels, divided by that of the magnitudes of
  /// their sums. 1 if all intensities have one sign, and if there is nothing to sum.
  double cancellation = 1.0;
};

/// Compares the float32 evaluation of a field with its definition in float64, on bricks that are
/// spread evenly over the list of all bricks, and on those in which the ellipsoids with the smallest
/// and the largest scale, the largest aspect ratio and the largest intensity are centered.
/// \throws MemoryExceeded  as for reachedBricks
[[nodiscard]] Stability measureStability(const Field& field, const StabilityOptions& options = {});

}  // namespace esvr::test
