#pragma once
/// Quantises a grid with given steps and measures its size and error.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/quantised.h"
#include "esvr/volume.h"
#include "fit/intensity_problem.h"

namespace esvr {

struct Trial {
  QuantiserSteps steps;
  Field field;  ///< dequantised field, which a reader gets
  std::vector<QuantisedEllipsoids> quantised;
  double error = 0.0;       ///< sum of squared errors over the box
  std::uint64_t bytes = 0;  ///< bytes of the ellipsoids' sections
};

/// The reference of the measurements, the box that counts and the device that computes.
struct TrialTarget {
  const SparseVolume& source;
  Box box;
  Device device;
  std::optional<double> peak{};  ///< peak of the PSNR; default: peakOf(source)
  /// Trials are rounded and counted only: the intensities are not solved for, and the error of a trial
  /// is that of the float32 field. \ref TrialMaker::measure gives the true one.
  bool quick = false;
};

class TrialMaker {
 public:
  /// The volumes must outlive the maker. \throws DeviceError  the GPU cannot be used
  TrialMaker(const StoredGrid& grid, const TrialTarget& target);
  TrialMaker(const TrialMaker&) = delete;
  TrialMaker& operator=(const TrialMaker&) = delete;

  /// The sum of squares over the box that corresponds to a PSNR in dB.
  [[nodiscard]] double squaresOf(double psnr) const;

  /// A sum of squares that is always allowed. It takes the place of a relative loss if the fit is
  /// exact or nearly exact.
  [[nodiscard]] double negligibleError() const;

  /// Error of the float32 field.
  [[nodiscard]] double error() const { return error_; }
  /// Error of the float32 field with optimal intensities, which is the limit of fine steps.
  [[nodiscard]] double leastError() const { return leastError_; }
  [[nodiscard]] std::size_t count() const { return field_.ellipsoidCount(); }

  /// Rounds the shapes, solves for the intensities with the rounded shapes, and rounds these.
  [[nodiscard]] Trial make(const QuantiserSteps& steps);
  /// Makes several trials at once, each with the same result as alone.
  [[nodiscard]] std::vector<Trial> make(std::span<const QuantiserSteps> steps) {
    return make(steps, problem_);
  }
  /// Makes trials for comparison with each other. The intensities are solved and the errors are
  /// measured on a sample of the bricks only; the bytes are those of all ellipsoids.
  [[nodiscard]] std::vector<Trial> sample(std::span<const QuantiserSteps> steps);

  /// The error of a trial of a quick maker.
  [[nodiscard]] double measure(const Trial& trial);

  /// The error of the first k layers for each k; the last row is the trial itself. Empty if there
  /// is only one layer.
  [[nodiscard]] std::vector<LayerError> layerErrors(const Trial& trial);

 private:
  void solveField();
  void quantiseChunks(Trial& trial) const;
  [[nodiscard]] StoredError errorOf(const Field& field, std::span<const float> intensities);
  [[nodiscard]] std::vector<Trial> make(std::span<const QuantiserSteps> steps,
                                        IntensityProblem& problem) const;

  // Targets refer to the bricks before them, and problems to their targets.
  std::vector<Coord> bricks_;
  IntensityTarget target_;
  std::vector<Coord> sampleBricks_;
  IntensityTarget sampleTarget_;
  IntensityProblem problem_, sampleProblem_;
  Field field_;  ///< float32 field with optimal intensities, from which the trials' solver starts
  std::vector<std::vector<double>> curvature_;  ///< sum of phi^2 of each ellipsoid, by chunk
  bool quick_;
  double peak_, error_ = 0.0, leastError_ = 0.0;
};

}  // namespace esvr
