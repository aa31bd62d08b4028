#pragma once
/// The intensities that serve a field best when all its shapes are given: a sparse linear least
/// squares problem, solved without its matrix.

#include <cstddef>
#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"
#include "field/brick_kernels.h"
#include "field/evaluate_plan.h"
#include "field/stored_value.h"
#include "fit/pair_tapes.h"

namespace esvr {

/// What the sum is to be, and how it becomes voxels.
struct IntensityTarget {
  const SparseVolume& source;
  StoredValue stored;
  Box box;                          ///< errors count here
  std::span<const Coord> bricks{};  ///< index corners of all bricks that can hold an active voxel
  bool restrictToBricks = false;    ///< else those that supports reach as well
};

class IntensityProblem {
 public:
  /// Both must outlive the problem; of the field, only its shapes matter here.
  IntensityProblem(const Field& field, const IntensityTarget& target);

  /// Sum of squared errors of the voxels that a reader gets, over the target's box.
  /// \param intensities  of all chunks, one behind the other
  [[nodiscard]] double error(std::span<const float> intensities);

  /// sum phi^2 over voxels, for each ellipsoid.
  [[nodiscard]] const std::vector<double>& curvature();

  /// Lowers the error by conjugate gradients on the normal equations with Jacobi's preconditioner,
  /// float64 sums in a fixed order. Voxels that come back exactly, as those below the threshold do,
  /// take no part; where no intensity is negative, none becomes so. \return the error reached,
  /// never above the one before
  double solve(std::vector<float>& intensities, int iterations);

 private:
  void setForms(std::span<const float> intensities);
  /// Residuals of one brick, zero where the stored voxel is exact. \return the stored error
  double residualOf(std::size_t brick, float* sum, BrickMask* exact) const;
  double gradientAt(std::span<const float> intensities, std::vector<double>& gradient);
  void applyNormal(std::span<const double> direction, std::vector<double>& out);
  const std::vector<PairTape>& forward(std::size_t brick, PairTapes& scratch, float* sum);
  template <class Middle>
  void pass(std::vector<double>* rPhi, std::vector<double>* phi2, const Middle& middle);
  std::vector<double> conjugateGradients(std::vector<double> residual, int iterations);

  const SparseVolume& source_;
  StoredValue stored_;
  Box box_;
  float background_;
  std::vector<Coord> corners_;
  EvaluatePlan plan_;
  std::vector<PairProjection> projections_;
  std::vector<KeptTapes> kept_;  ///< a brick's, from the first pass on
  std::vector<double> brickError_;
  std::vector<BrickMask> exact_;
  std::vector<double> curvature_;
};

/// Intensities of all chunks, one behind the other, and back.
[[nodiscard]] std::vector<float> intensitiesOf(const Field& field);
void setIntensities(std::span<const float> intensities, Field& field);

}  // namespace esvr
