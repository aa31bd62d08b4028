#pragma once
/// How precisely fields are evaluated in float32, and what makes their evaluation difficult: the definition in float64,
/// the bound of the rounding, which docs/math.md, "Rounding", derives, and the comparison of both on bricks of a field.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
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

/// The arithmetic that evaluates a field, as far as the bound of its errors depends on it.
struct Arithmetic {
  /// Sums of a brick are integers in units of a part of its largest intensity, and numbers below the
  /// normal ones of float32 count as 0: the decoder on a GPU.
  bool integerSums = false;
};

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

  /// Bound of the difference of V in float32 at a voxel from its value in float64.
  [[nodiscard]] double bound(const ReferenceBrick& brick, int voxel,
                             const Arithmetic& arithmetic) const;

 private:
  const Field& field_;
  std::vector<Box> boxes_;  ///< bounding boxes of the supports, index coordinates
};

// ---- The ellipsoids that are most difficult to evaluate

/// The extremes of the ellipsoids of a field. All are 0 if it has none.
struct FieldExtremes {
  double smallestScale = 0.0, largestScale = 0.0;  ///< voxels
  double largestAspect = 0.0;     ///< largest scale of an ellipsoid divided by its smallest
  double largestCondition = 0.0;  ///< condition number of Sigma: the largest aspect squared
  double lowestKappa = 0.0, highestKappa = 0.0;
  double smallestIntensity = 0.0, largestIntensity = 0.0;  ///< magnitudes
};
[[nodiscard]] FieldExtremes extremesOf(const Field& field);

/// The voxels nearest to the centers of the ellipsoids with the smallest and the largest scale, the
/// largest aspect ratio and the largest intensity.
[[nodiscard]] std::vector<Coord> centersOfExtremes(const Field& field);

// ---- The comparison

/// Evaluates bricks in float32. The arguments are those of evaluateBricks().
using EvaluateBricks =
    std::function<void(const Field& field, std::span<const Coord> corners, std::span<float> out)>;

/// Evaluates V at all voxels of bricks as the device does: on the CPU with evaluateBricks(), by which files become
/// voxels, and on a GPU with the decoder of the renderers.
/// \throws DeviceError  the device does not exist, the build has no CUDA, or memory is exhausted
void evaluateBricksOn(const Device& device, const Field& field, std::span<const Coord> corners,
                      std::span<float> out);
/// Its arithmetic.
[[nodiscard]] Arithmetic arithmeticOf(const Device& device);

struct StabilityOptions {
  std::size_t samples = 256;  ///< bricks that are compared, at least 1
  std::size_t worst = 5;      ///< bricks of the largest differences that are listed
  /// Index corners (multiples of 8, increasing) of the bricks from which samples are taken. Empty:
  /// all bricks that ellipsoids reach.
  std::span<const Coord> bricks{};
  Box within = Box::whole();          ///< bricks without a voxel in this box are left out
  std::optional<ValueRange> range{};  ///< both values are clamped to it before they are compared
  EvaluateBricks evaluate{};          ///< empty: evaluateBricks(), on the CPU
  Arithmetic arithmetic{};            ///< that of `evaluate`
};

/// The comparison of one brick.
struct BrickDifference {
  Coord corner;             ///< index corner of the brick
  Coord at;                 ///< voxel of the largest difference
  double largest = 0.0;     ///< largest difference, value units; infinite if a value is not finite
  double squares = 0.0;     ///< sum of the squares of the differences
  double bound = 0.0;       ///< largest bound of a voxel's difference
  double shareOfBound = 0;  ///< largest difference of a voxel, divided by its own bound
};

struct Stability {
  FieldExtremes extremes;
  std::size_t bricks = 0;                  ///< from which samples were taken
  std::size_t sampled = 0;                 ///< bricks that were compared
  double largest = 0.0, rms = 0.0;         ///< differences, value units
  double bound = 0.0, shareOfBound = 0.0;  ///< the largest of the bricks
  double peak = 0.0;  ///< largest |V - background| of the sampled voxels, before it is clamped
  /// Ellipsoids whose support contains a voxel: mean over the sampled voxels that lie in at least
  /// one support, and the largest number.
  double meanOverlap = 0.0;
  std::uint32_t largestOverlap = 0;
  /// Cancellation is the sum of the magnitudes of the terms of V - background, divided by the
  /// magnitude of their sum. The mean is the ratio of the two sums over the sampled voxels; the
  /// largest is that of a voxel where |V - background| is at least a hundredth of the peak. Both
  /// are 1 if all intensities have one sign, and if there is nothing to sum.
  double meanCancellation = 1.0, largestCancellation = 1.0;
  std::vector<BrickDifference> worst;  ///< those of the largest differences, the largest one first
};

/// Compares the float32 evaluation of a field with its definition in float64, on bricks that are
/// spread evenly over the list of all bricks, and on those in which the ellipsoids with the smallest
/// and the largest scale, the largest aspect ratio and the largest intensity are centered. The result
/// is the same on any number of threads.
/// \throws MemoryExceeded  as for reachedBricks
[[nodiscard]] Stability measureStability(const Field& field, const StabilityOptions& options = {});

/// The number of leading decimal digits that a difference leaves correct: the largest whole d with
/// difference <= 10^-d peak, at most 17, which stands for no difference. 0 if the peak is 0 and there
/// is a difference, or if the difference is not finite.
[[nodiscard]] int correctDigits(double difference, double peak);

}  // namespace esvr::test
