#pragma once
/// Finds the optimal intensities of a field whose shapes are given: a sparse linear least-squares
/// problem that is solved without forming its matrix.

#include <memory>
#include <span>
#include <vector>

#include "fit/intensity_passes.h"

namespace esvr {

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
