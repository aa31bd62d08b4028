#pragma once
/// The state of a run of the paper's method and its iteration, wherever it is computed; paper_run.h
/// decides what comes when.

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "esvr/device.h"
#include "fit/optimiser.h"
#include "fit/paper/paper_math.h"
#include "fit/paper/subvolumes.h"

namespace esvr::paper {

struct PaperOptions {
  KernelKind kind;
  double beta = 0.2;
  int subvolumeSide = 0;  ///< voxels
  Device device;
  std::optional<std::size_t> maxDeviceBytes;
  /// On a GPU: only the subvolume that is visited is there. So it is, too, where all do not fit.
  bool visitOnly = false;
};

struct LossGradients {
  double loss = 0.0;
  std::vector<PaperVector> byEllipsoid;
};

class PaperOptimiser {
 public:
  virtual ~PaperOptimiser() = default;

  [[nodiscard]] virtual std::size_t subvolumeCount() const = 0;

  /// Gradients of the loss over one subvolume, and a step of every ellipsoid: those that it does
  /// not reach go on by their momentum.
  virtual void iterate(std::size_t subvolume, const PaperStep& step) = 0;

  /// What iterate() would step by.
  [[nodiscard]] virtual LossGradients gradients(std::size_t subvolume) = 0;

  /// Takes over ellipsoids as they are.
  virtual void put(const Population& population) = 0;
  [[nodiscard]] virtual Population population() const = 0;
  [[nodiscard]] virtual std::size_t ellipsoidCount() const = 0;

  /// Over all subvolumes; an ellipsoid beyond all of them counts for nothing.
  /// \throws RuntimeFailure  an ellipsoid is not finite
  [[nodiscard]] virtual FitErrors measure() = 0;

  /// Of the lists last built.
  [[nodiscard]] virtual std::uint64_t pairCount() const = 0;
  /// The most that has been held so far; 0 on the CPU.
  [[nodiscard]] virtual std::size_t deviceBytes() const = 0;
};

/// The largest distance, in voxels, that a support's border of the usual size moves by in a step:
/// lists serve as long as the sum stays below their slack.
[[nodiscard]] inline double motionOf(const PaperStep& step) {
  constexpr double kUsualRadius = 3.0;  // voxels
  return step.rates[0] + kUsualRadius * (step.rates[3] + step.rates[6]);
}
/// Voxels by which supports are widened in the lists.
inline constexpr double kListSlack = 0.5;

/// An optimiser on the device of the options. The target must outlive it.
/// \throws DeviceError  that device cannot be used
[[nodiscard]] std::unique_ptr<PaperOptimiser> makePaperOptimiser(const FitTarget& target,
                                                                 const PaperOptions& options);

}  // namespace esvr::paper
