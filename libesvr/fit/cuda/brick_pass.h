#pragma once
/// A pass over the bricks. It computes the residuals, their squares, and the moments of the pairs.

#include <cuda_runtime_api.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/cuda/integer_sum.cuh"
#include "core/cuda/runtime.h"
#include "field/brick_kernels.h"
#include "fit/cuda/lists.h"

namespace esvr::cuda {

/// An ellipsoid in the form that the passes read.
struct alignas(16) PairForm {
  LineForm form;
  Coord frame;  ///< voxel that the form's center is relative to
  float halfZ;  ///< half width of the support's bounding box along z
};

#if defined(__CUDACC__)
__device__ inline PairForm pairForm(const Ellipsoid& p, double radius) {
  const Coord frame = frameOf(p.center);
  const Matrix3 F = inverse(p.L);
  const auto center = inFrame(p.center, frame);
  return {makeLineForm(center, p.L, radius, p.intensity), frame,
          float(radius * std::sqrt(sigma(F, 2, 2)))};
}
#endif

/// The data that every pass reads. All pointers are to device memory that the caller owns.
struct PassScene {
  const Coord* bricks;  ///< the target's bricks first
  std::uint32_t brickCount, targetCount;
  std::uint32_t ellipsoidCount, pairCount;
  PairListsView lists;
  const PairForm* forms;  ///< one for each ellipsoid
};

[[nodiscard]] inline PassScene passScene(const BrickTable& bricks, const PairLists& lists,
                                         std::size_t ellipsoidCount, const PairForm* forms) {
  return {bricks.view().bricks,
          std::uint32_t(bricks.size()),
          std::uint32_t(bricks.targetCount()),
          std::uint32_t(ellipsoidCount),
          std::uint32_t(lists.pairCount()),
          lists.view(),
          forms};
}

/// \return an upper bound for the number of bricks with lists of kMaxNarrowEntries or more, which
///         come first in PairListsView::brickOrder; 0 if no list can be longer
[[nodiscard]] inline std::uint32_t maxWideBricks(const PassScene& scene) {
  static_assert(std::has_single_bit(kMaxNarrowEntries), "as PairListsView::brickOrder says");
  if (scene.ellipsoidCount <= kMaxNarrowEntries) return 0;
  return std::min(scene.brickCount, scene.pairCount / kMaxNarrowEntries);
}

/// The values that the sum is compared with.
struct PassTarget {
  const float* values;     ///< kBrickVoxels values for each of the first `bricks` bricks
  const float* constants;  ///< values that are added to the sums of these bricks; null: none
  std::uint32_t bricks;    ///< bricks that have values; the values of all others are 0
  bool saturates;          ///< the sum is clamped to [lowest, highest] before it is compared
  float lowest, highest;   ///< range of the target
};

/// A flag that makes kernels do nothing once the pair lists are outdated (fit/motion_bound.h). The
/// host starts several steps ahead. The step at which the lists end sets the flag of the steps
/// after it; the host starts these again after it has built new lists.
/// \param flag  flag in device memory; null: never halted
ESVR_HD inline bool isHalted(const int* flag) { return flag != nullptr && *flag != 0; }

/// All pointers are to device memory that the caller owns.
struct BrickPassArguments {
  PassScene scene;
  KernelConstants<float> kernel;
  PassTarget target;
  double* brickLoss;  ///< output: sum of r^2 of each brick
  float* moments;     ///< output of launchGradients: kMoments values for each pair
  float* residual;    ///< output: kBrickVoxels values for each brick; null: not wanted
  const int* halted;  ///< flag of isHalted()
};

/// Number of moments of a pair. They are stored in the order of PairMoments.
inline constexpr int kMoments = 12;

/// Chooses the number of threads that work on one brick. With few threads more bricks are in work
/// at the same time; with many threads a brick with a long list is done sooner. The better choice
/// depends on the scene and the device, so a run measures it from time to time. The choice does not
/// change any result.
class ThreadsPerBrick {
 public:
  static constexpr int kChoices = 3;
  static constexpr int threads(int choice) { return 128 << choice; }

  /// Calls pass(threads), which starts a pass on the stream, with the best number of threads.
  /// During a measurement it tries the next number instead.
  template <class Pass>
  void run(cudaStream_t stream, const Pass& pass) {
    if (tried_ == kChoices) return pass(threads(best_));
    Trial& trial = trials_[std::size_t(tried_)];
    trial.begin.record(stream);
    pass(threads(tried_++));
    trial.end.record(stream);
  }

  /// Must be called after new lists have been built, where the host has waited for the stream. It
  /// takes the fastest of the measured numbers, and starts a new measurement after some lists.
  /// \param passes  number of calls of run() since the last call that did work. The calls after
  ///                them were halted (StepStatus), so their times are not valid
  void listsChanged(std::size_t passes);

 private:
  struct Trial {
    Event begin, end;
  };
  std::array<Trial, kChoices> trials_;
  int tried_ = 0;        ///< choices that the current measurement has tried
  int triedBefore_ = 0;  ///< value of tried_ at the last call of listsChanged()
  int best_ = 1;
  bool measuring_ = true;
  std::size_t served_ = 0;  ///< passes since the last measurement
};

/// Writes the loss, and the moments for the gradients of 1/2 sum r^2.
/// \param threads  threads for each brick, one of ThreadsPerBrick::threads()
void launchGradients(const BrickPassArguments& arguments, int threads, cudaStream_t stream);
/// Writes the loss and the residuals.
void launchResiduals(const BrickPassArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
