#pragma once
/// A grid quantised with given steps: what it costs and how far it is off.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/container.h"
#include "esvr/device.h"
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

/// What is measured against: where it counts, and where the work is done.
struct TrialTarget {
  const SparseVolume& source;
  Box box;
  Device device;
};

class TrialMaker {
 public:
  /// Grid and source must outlive the maker. \throws DeviceError  the GPU cannot be used
  TrialMaker(const StoredGrid& grid, const TrialTarget& target);

  /// Sum of squares over the box of a PSNR.
  [[nodiscard]] double squaresOf(double psnr) const;

  /// Where the fit is exact, or nearly, there is nothing to compare a loss with: an error that no
  /// one sees.
  [[nodiscard]] double invisibleError() const;

  /// Error of the float32 field.
  [[nodiscard]] double error() const { return error_; }
  /// The same with the intensities that serve its shapes best: what finer steps come near to.
  [[nodiscard]] double leastError() const { return leastError_; }
  [[nodiscard]] std::size_t count() const { return field_.ellipsoidCount(); }

  /// Rounds the shapes, fits the intensities to what became of them, and rounds these.
  [[nodiscard]] Trial make(const QuantiserSteps& steps);
  /// Several at once, each as it would be alone.
  [[nodiscard]] std::vector<Trial> make(std::span<const QuantiserSteps> steps);
  /// The same to compare with one another: their errors are of a part of the bricks, and so is the
  /// fit of their intensities. Bytes are of all.
  [[nodiscard]] std::vector<Trial> sample(std::span<const QuantiserSteps> steps);

  /// How far off each prefix of the layers is, the last the trial itself; nothing where there is
  /// but one layer.
  [[nodiscard]] std::vector<LayerError> layerErrors(const Trial& trial);

 private:
  void quantiseChunks(Trial& trial) const;
  [[nodiscard]] std::vector<Trial> make(std::span<const QuantiserSteps> steps,
                                        IntensityProblem& problem) const;

  IntensityTarget target_;
  std::vector<Coord> sampleBricks_;
  IntensityTarget sampleTarget_;
  IntensityProblem problem_, sampleProblem_;
  Field field_;  ///< float32, with its best intensities: those of rounded shapes are not far
  std::vector<std::vector<double>> curvature_;  ///< by chunk
  double peak_, error_ = 0.0, leastError_ = 0.0;
};

}  // namespace esvr
