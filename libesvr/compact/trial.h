#pragma once
/// A grid quantised with given steps: what it costs and how far it is off.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "esvr/container.h"
#include "esvr/quantised.h"
#include "esvr/sparse_volume.h"
#include "fit/intensity_problem.h"

namespace esvr {

struct Trial {
  QuantiserSteps steps;
  Field field;  ///< what a reader gets
  std::vector<QuantisedEllipsoids> quantised;
  double error = 0.0;       ///< sum of squares over the box
  std::uint64_t bytes = 0;  ///< of the ellipsoids
};

class TrialMaker {
 public:
  /// All must outlive the maker.
  TrialMaker(const EncodedGrid& grid, const SparseVolume& source, const Box& box);

  /// Where the fit is exact, or nearly, there is nothing to compare a loss with: an error that no
  /// one sees.
  [[nodiscard]] double invisibleError() const { return invisible_; }

  /// Error of the float32 field.
  [[nodiscard]] double error() const { return error_; }
  [[nodiscard]] std::size_t count() const { return field_.primitiveCount(); }

  /// \param iterations  of the solver that fits the intensities to the rounded shapes
  [[nodiscard]] Trial make(const QuantiserSteps& steps, int iterations) const;

 private:
  void quantiseChunks(Trial& trial) const;
  void solveIntensities(Trial& trial, int iterations) const;

  const Field& field_;
  IntensityTarget target_;
  std::vector<std::vector<double>> curvature_;  ///< by chunk
  double error_ = 0.0, invisible_ = 0.0;
};

/// Sum of squares over a box of a PSNR.
[[nodiscard]] double squaresOf(double psnr, const SparseVolume& source, const Box& box);

}  // namespace esvr
