#pragma once
/// The paper's method on any device: the subvolumes, which are cubes, the state of a run and its
/// iteration. fit_paper.cpp decides the order of the operations.

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "esvr/device.h"
#include "fit/optimiser.h"
#include "fit/paper/paper_ellipsoid.h"
#include "fit/target.h"

namespace esvr::paper {

/// The volume that is divided: whole bricks around the target's box and bricks.
struct Space {
  Box bricks;
  [[nodiscard]] int longestAxis() const;   ///< voxels
  [[nodiscard]] int shortestAxis() const;  ///< voxels
  [[nodiscard]] Box voxels() const;
};
[[nodiscard]] Space spaceOf(const FitTarget& target);

/// The side of the subvolumes, which is a multiple of 8 voxels.
/// \param asked  wanted side in voxels; 0: half the longest axis, or the shortest axis if that is
///               less (paper, appendix 'Subvolume configuration')
[[nodiscard]] int subvolumeSide(const Space& space, int asked);

/// A subvolume: its part of the target, whose `within` is the box of the subvolume.
struct Subvolume {
  FitTarget target;
  std::vector<BrickMask> active;
};

/// Divides a target into subvolumes in the order of their coordinates, including those without
/// target bricks. They are allocated one by one, because each target points to its masks.
[[nodiscard]] std::vector<std::unique_ptr<Subvolume>> cutSubvolumes(const FitTarget& target,
                                                                    const Space& space, int side);

struct PaperOptions {
  KernelKind kind;
  double beta = 0.2;
  int subvolumeSide = 0;  ///< voxels
  Device device;
  std::optional<std::size_t> maxDeviceBytes;
  /// On a GPU: only the visited subvolume is in GPU memory, even if all subvolumes would fit.
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

  /// Computes the gradients of the loss over one subvolume and takes a step with every ellipsoid.
  /// Ellipsoids that do not reach the subvolume move by their momentum.
  virtual void iterate(std::size_t subvolume, const PaperStep& step) = 0;

  /// The gradients of iterate().
  [[nodiscard]] virtual LossGradients gradients(std::size_t subvolume) = 0;

  /// Replaces the population.
  virtual void put(const Population& population) = 0;
  [[nodiscard]] virtual Population population() const = 0;
  [[nodiscard]] virtual std::size_t ellipsoidCount() const = 0;

  /// Measures the errors over all subvolumes. Ellipsoids outside all of them do not count.
  /// \throws RuntimeFailure  an ellipsoid is not finite
  [[nodiscard]] virtual FitErrors measure() = 0;

  /// Pairs in the lists that were built last.
  [[nodiscard]] virtual std::uint64_t pairCount() const = 0;
  /// Largest GPU memory held so far; 0 on the CPU.
  [[nodiscard]] virtual std::size_t deviceBytes() const = 0;
};

/// The largest distance, in voxels, by which the border of a support of usual size moves in a step.
/// Lists are valid while the sum of these distances is below their slack.
[[nodiscard]] inline double motionOf(const PaperStep& step) {
  constexpr double kUsualRadius = 3.0;  // voxels
  return step.rates[0] + kUsualRadius * (step.rates[3] + step.rates[6]);
}
/// Voxels by which supports are widened in the lists.
inline constexpr double kListSlack = 0.5;

/// Makes an optimiser on the device of the options. The target must outlive it.
/// \throws DeviceError  the device cannot be used
[[nodiscard]] std::unique_ptr<PaperOptimiser> makePaperOptimiser(const FitTarget& target,
                                                                 const PaperOptions& options);

}  // namespace esvr::paper
