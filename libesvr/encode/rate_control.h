#pragma once
/// Rate control of ellipsoids: the steps of the four parameter streams with which a fitted grid takes the fewest bytes for
/// an error, or has the smallest error for its bytes. The rest of the encoder calls compactGrid(), or Compactor where a judge
/// measures the results.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/metrics.h"
#include "esvr/quantised.h"
#include "esvr/volume.h"
#include "fit/intensity_problem.h"

namespace esvr::encode {

// Compacts a fitted grid. Rate control chooses the quantisation steps; the ellipsoids are
// quantised, and their intensities are solved for again.

struct CompactOptions {
  /// PSNR over the box, in dB, that quantising may lose against the same ellipsoids in float32. With
  /// 0.1 dB, a file is hardly worse than its fit; 0.3 dB would save 2 to 11 % of the bytes.
  double loss = 0.1;
  /// PSNR over the box, in dB, that the smallest result must reach. It replaces `loss`.
  std::optional<double> psnr{};
  /// Bytes that the ellipsoids of the best result may take. It replaces `loss` and `psnr`.
  std::optional<std::uint64_t> bytes{};
  std::optional<Box> box{};      ///< box of the PSNR; default: the active bounding box
  std::optional<double> peak{};  ///< peak of the PSNR, above 0; default: peakOf() of the source
  Device device{};               ///< device that evaluates the trials
  bool layerErrors = true;       ///< whether the errors of the layers are measured
  /// The result is made in about the time of three evaluations of the grid: the steps are those with
  /// which a search would begin, or, for `bytes`, the first that fit; the intensities are rounded but
  /// not solved for, and there are no errors of layers. It serves for
  /// forecasts, and to complete a conversion that was cancelled.
  bool quick = false;
};

struct CompactResult {
  StoredGrid grid;  ///< the quantised grid; its field is the one that a reader gets
  QuantiserSteps steps;
  double loss = 0.0;        ///< dB; negative if solving for the intensities gained more
  std::uint64_t bytes = 0;  ///< bytes of the ellipsoids
};

/// Compacts a grid. The result is deterministic on one device. Devices round differently, so that
/// they may choose different steps. If the wanted PSNR or size is out of reach, the result is the
/// nearest one found.
/// \param grid  a grid that makeStoredGrid made from `source`; Ellipsoids::kappa must be empty
/// \throws RuntimeFailure  no quantisation lattice can hold the ellipsoids, or each ellipsoid has
///                         its own kappa
/// \throws DeviceError  the GPU cannot be used
[[nodiscard]] CompactResult compactGrid(const StoredGrid& grid, const SparseVolume& source,
                                        const CompactOptions& options = {});

/// A grid whose ellipsoids were quantised with given steps.
struct RateTrial {
  QuantiserSteps steps;
  Field field;  ///< dequantised field, which a reader gets
  std::vector<QuantisedEllipsoids> quantised;
  double error = 0.0;       ///< sum of squared errors over the box
  std::uint64_t bytes = 0;  ///< bytes of the ellipsoids' sections
};

/// Quantises one grid with one set of steps after the other.
class RateTrials {
 public:
  /// \param options  their box, peak and device; `quick`: trials are rounded and counted only, the intensities are not
  ///                 solved for, and the error of a trial is that of the float32 field. \ref measure gives the true one
  /// The source must outlive the object. \throws DeviceError  the GPU cannot be used
  RateTrials(const StoredGrid& grid, const SparseVolume& source, const CompactOptions& options);
  RateTrials(const RateTrials&) = delete;
  RateTrials& operator=(const RateTrials&) = delete;

  /// The sum of squares over the box that corresponds to a PSNR in dB.
  [[nodiscard]] double squaresOf(double psnr) const;

  /// A sum of squares that is always allowed. It takes the place of a relative loss if the fit is exact or nearly exact.
  [[nodiscard]] double negligibleError() const;

  /// Error of the float32 field.
  [[nodiscard]] double error() const { return error_; }
  /// Error of the float32 field with optimal intensities, which is the limit of fine steps.
  [[nodiscard]] double leastError() const { return leastError_; }
  [[nodiscard]] std::size_t count() const { return field_.ellipsoidCount(); }

  /// Rounds the shapes, solves for the intensities with the rounded shapes, and rounds these.
  [[nodiscard]] RateTrial make(const QuantiserSteps& steps);
  /// Makes several trials, each with the same result as alone.
  [[nodiscard]] std::vector<RateTrial> make(std::span<const QuantiserSteps> steps) {
    return make(steps, problem_);
  }
  /// Makes trials for comparison with each other. The intensities are solved and the errors are measured on a sample of
  /// the bricks only; the bytes are those of all ellipsoids.
  [[nodiscard]] std::vector<RateTrial> sample(std::span<const QuantiserSteps> steps);

  /// The error of a trial, measured.
  [[nodiscard]] double measure(const RateTrial& trial);

  /// The error of the first k layers for each k; the last row is the trial itself. Empty if there is only one layer.
  [[nodiscard]] std::vector<LayerError> layerErrors(const RateTrial& trial);

 private:
  void solveField();
  void quantiseChunks(RateTrial& trial) const;
  [[nodiscard]] StoredError errorOf(const Field& field, std::span<const float> intensities);
  [[nodiscard]] std::vector<RateTrial> make(std::span<const QuantiserSteps> steps,
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

/// The errors of the first layers of a grid, by decoding them; empty unless it has several.
[[nodiscard]] std::vector<LayerError> layerErrorsOf(const StoredGrid& grid,
                                                    const SparseVolume& source,
                                                    const CompareOptions& options);

/// Steps that are finer by a number of octaves.
[[nodiscard]] QuantiserSteps finer(QuantiserSteps steps, double octaves);

/// A quality that the trials of rate control do not know.
struct JudgedGoal {
  double quality = 0.0;  ///< dB
  /// About the dB that are lost by rounding, a quarter of which steps of half the size lose.
  double loss = 1.0;
  std::function<double(CompactResult&)> judge;  ///< the quality of a result, which it may change
  /// Steps to begin with; nothing: those that should lose as much as the options say.
  std::optional<QuantiserSteps> first{};
};
struct JudgedResult {
  CompactResult result;
  double quality = 0.0;
};

/// Compacts one grid several times. compactGrid() does it once. Between the results, the trials and their memory stay.
class Compactor {
 public:
  /// The grid and the source must outlive the object. \throws DeviceError  the GPU cannot be used
  Compactor(const StoredGrid& grid, const SparseVolume& source, const CompactOptions& options);

  /// The best result within the goal of the options.
  [[nodiscard]] CompactResult toGoal();
  /// The result with given steps, whatever the goal is.
  [[nodiscard]] CompactResult at(const QuantiserSteps& steps);
  /// The smallest result whose PSNR is that of the options for a reader, who has a mask.
  [[nodiscard]] CompactResult toPsnrOfReader();
  /// The smallest result with a judged quality. It scales all steps of the first one. \return the best one if none reaches the quality, or the call is cancelled meanwhile
  [[nodiscard]] JudgedResult toQuality(const JudgedGoal& goal);

 private:
  [[nodiscard]] JudgedResult scaledTo(const JudgedGoal& goal, CompactResult made);
  [[nodiscard]] CompactResult resultOf(RateTrial trial);

  const StoredGrid& grid_;
  const SparseVolume& source_;
  CompactOptions options_;
  Box box_;
  std::optional<RateTrials> trials_;  ///< nothing if the grid has no ellipsoids
};

}  // namespace esvr::encode
