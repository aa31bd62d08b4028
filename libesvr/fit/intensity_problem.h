#pragma once
/// The intensities that serve a field best when all its shapes are given: a sparse linear least
/// squares problem, solved without its matrix.

#include <memory>
#include <span>
#include <vector>

#include "fit/intensity_passes.h"

namespace esvr {

/// Fields are taken one after the other, against one target: what both devices keep of it, and
/// their memory, serves all.
class IntensityProblem {
 public:
  /// \param target  must outlive the problem \throws DeviceError  the GPU cannot be used
  explicit IntensityProblem(const IntensityTarget& target, const Device& device = {})
      : passes_(makeIntensityPasses(target, device)) {}

  /// All that follows is of this field; only its shapes and its background matter here.
  void setShapes(const Field& field) { passes_->setShapes(field); }

  /// \param intensities  of all chunks, one behind the other
  [[nodiscard]] StoredError error(std::span<const float> intensities) {
    return passes_->error(intensities);
  }

  /// Lowers the error by conjugate gradients on the normal equations with Jacobi's preconditioner.
  /// Voxels that come back exactly, as those below the threshold do, take no part; where no
  /// intensity is negative, none becomes so. \return the sum of squared errors reached, never above
  /// the one before
  double solve(std::vector<float>& intensities, int iterations);

  /// The step of solve() in full length, whatever becomes of the error: a pass less.
  /// \return the sum of squared errors before it
  double step(std::vector<float>& intensities, int iterations);

  /// sum phi^2 over voxels, for each ellipsoid; of the last field solved for.
  [[nodiscard]] const std::vector<double>& curvature() const { return gradient_.curvature; }

 private:
  std::vector<double> conjugateGradients(int iterations);

  std::unique_ptr<IntensityPasses> passes_;
  IntensityGradient gradient_;
};

/// Intensities of all chunks, one behind the other, and back.
[[nodiscard]] std::vector<float> intensitiesOf(const Field& field);
void setIntensities(std::span<const float> intensities, Field& field);

}  // namespace esvr
