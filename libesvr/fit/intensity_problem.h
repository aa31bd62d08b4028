#pragma once
/// Finds the optimal intensities of a field whose shapes are given: a sparse linear least-squares
/// problem that is solved without forming its matrix A, which has a row for each voxel, a column
/// for each ellipsoid and phi as entries. A device provides the passes over the bricks: from
/// intensities to the sum, and from residuals back to ellipsoids.

#include <memory>
#include <span>
#include <vector>

#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "esvr/volume.h"
#include "field/voxel_rule.h"

namespace esvr {

/// The values that the sum is to reach, and the rule by which the sum becomes voxels.
struct IntensityTarget {
  const SparseVolume& source;
  VoxelRule rule;
  Box box;                          ///< box over which errors are measured
  std::span<const Coord> bricks{};  ///< index corners of the stored bricks, see restrictToBricks
  /// True if only `bricks` can have an active voxel. Otherwise the source's bricks and the bricks
  /// that supports reach can as well.
  bool restrictToBricks = false;
};

/// The error of the voxels that a reader gets, over the target's box.
struct StoredError {
  double squares = 0.0;  ///< sum of squared errors
  double largest = 0.0;  ///< largest absolute error
};

/// Sums are formed in one order for any number of threads.
struct IntensityGradient {
  std::vector<double> byIntensity;  ///< A^T r, r = V - target
  std::vector<double> curvature;    ///< sum phi^2
};

/// Intensities and directions are those of all chunks, in their order. Sums over a brick are
/// float32, sums over bricks are float64 in a fixed order.
class IntensityPasses {
 public:
  virtual ~IntensityPasses() = default;

  /// Sets the shapes and the background for all later calls; the field's intensities are ignored.
  /// \throws RuntimeFailure  the ellipsoids have kappas of their own, on a GPU
  /// \throws DeviceError     the ellipsoids reach more bricks than a GPU can look at
  virtual void setShapes(const Field& field) = 0;

  [[nodiscard]] virtual StoredError error(std::span<const float> intensities) = 0;

  /// Computes the gradient of half the sum of squares. Voxels that a reader gets exactly, for
  /// example those below the threshold, have a residual of 0; applyNormal leaves them out until the
  /// next gradient.
  virtual StoredError gradient(std::span<const float> intensities, IntensityGradient& out) = 0;

  /// Multiplies a direction by A^T A, without the voxels that the last gradient left out.
  virtual void applyNormal(std::span<const double> direction, std::vector<double>& out) = 0;
};

/// Makes the passes of a device. The target must outlive them.
/// \throws DeviceError  the GPU cannot be used
[[nodiscard]] std::unique_ptr<IntensityPasses> makeIntensityPasses(const IntensityTarget& target,
                                                                   const Device& device);
[[nodiscard]] std::unique_ptr<IntensityPasses> makeCpuIntensityPasses(
    const IntensityTarget& target);

/// Index corners of the bricks that do not depend on the field, in increasing order.
[[nodiscard]] std::vector<Coord> knownCorners(const IntensityTarget& target);

/// The values of a brick in the source; null if the source does not have the brick.
[[nodiscard]] const float* sourceValues(const SparseVolume& source, Coord corner);

/// Solves for one field after the other against the same target, whose data stay on the device.
class IntensityProblem {
 public:
  /// The target must outlive the problem. \throws DeviceError  the GPU cannot be used
  explicit IntensityProblem(const IntensityTarget& target, const Device& device = {})
      : passes_(makeIntensityPasses(target, device)) {}

  /// Sets the field of all later calls, of which the shapes and the background are used.
  void setShapes(const Field& field) { passes_->setShapes(field); }

  /// \param intensities  intensities of all chunks, in their order
  [[nodiscard]] StoredError error(std::span<const float> intensities) {
    return passes_->error(intensities);
  }

  /// Reduces the error by conjugate gradients on the normal equations with a Jacobi preconditioner.
  /// Voxels that a reader gets exactly are left out. If no intensity is negative, none becomes
  /// negative.
  /// \return the sum of squared errors afterwards, which is never larger than before
  double solve(std::vector<float>& intensities, int iterations);

  /// Takes the full step of solve() without checking the error, which saves a pass.
  /// \return the sum of squared errors before the step
  double step(std::vector<float>& intensities, int iterations);

  /// Sum of phi^2 over voxels for each ellipsoid of the last field that was solved for.
  [[nodiscard]] const std::vector<double>& curvature() const { return gradient_.curvature; }

 private:
  std::vector<double> conjugateGradients(int iterations);

  std::unique_ptr<IntensityPasses> passes_;
  IntensityGradient gradient_;
};

/// Gets and sets the intensities of all chunks, in their order.
[[nodiscard]] std::vector<float> intensitiesOf(const Field& field);
void setIntensities(std::span<const float> intensities, Field& field);

}  // namespace esvr
