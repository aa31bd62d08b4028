#pragma once
/// What follows a pass over the bricks: sums of moments, a step with every ellipsoid, and the
/// errors of the fit. All pointers in arguments are to device memory that the caller owns.

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "core/cuda/device_buffer.h"
#include "fit/adam.h"
#include "fit/cuda/brick_pass.h"
#include "fit/motion_bound.h"
#include "fit/optimiser.h"

namespace esvr::cuda {

/// The status of the started steps, which the host reads back.
struct StepStatus {
  static constexpr std::size_t kMaxAhead = 64;  ///< steps that can be started before it is read

  double loss;                ///< sum of r^2 before the last step that was taken
  int diverged;               ///< not 0: an ellipsoid is not finite
  std::uint32_t refused;      ///< steps of ellipsoids that were refused since the lists were built
  int halted[kMaxAhead + 1];  ///< not 0 in place n: step n was not taken, nor were those after it

  /// \return how many of the steps were taken
  [[nodiscard]] std::size_t taken(std::size_t started) const {
    std::size_t n = 0;
    while (n < started && halted[n] == 0) ++n;
    return n;
  }
  /// \return true if the lists are still valid after the started steps
  [[nodiscard]] bool canGoOn(std::size_t started) const { return halted[started] == 0; }
};

/// The sums of each ellipsoid's moments, chunk by chunk.
struct MomentSums {
  PairListsView lists;
  std::uint32_t chunkCount;
  const float* moments;         ///< kMoments values for each pair
  double* chunkSums;            ///< output: kMoments values for each chunk
  const int* halted = nullptr;  ///< flag of isHalted()
};

/// Sums the chunks. sumsOf() adds up the chunks of an ellipsoid afterwards.
void launchMomentSums(const MomentSums& sums, cudaStream_t stream);

#if defined(__CUDACC__)
/// \return the moments of ellipsoid i. launchMomentSums must have been called before.
__device__ inline PairSums sumsOf(const MomentSums& a, std::uint32_t i) {
  PairSums s{};
  for (std::uint32_t c = a.lists.chunkBegin[i]; c < a.lists.chunkBegin[i + 1]; ++c) {
    const double* const m = a.chunkSums + std::size_t(c) * kMoments;
    s.w0x += m[0], s.w0z += m[1], s.w0xx += m[2], s.w0xz += m[3], s.w0zz += m[4];
    s.w1 += m[5], s.w1x += m[6], s.w1z += m[7], s.w2 += m[8], s.rPhi += m[9], s.phi2 += m[10];
    s.rEdge += m[11];
  }
  return s;
}

/// False if a parameter is not finite. The sum over all parameters is finite only if all are.
__device__ inline bool finite(const Ellipsoid& p) {
  double sum = p.intensity;
  for (const double c : p.center) sum += c;
  for (const double l : p.L) sum += l;
  return isfinite(sum);
}
#endif

/// The derivatives of the shared kernel by kappa.
struct KernelEdge {
  double slope;        ///< KernelConstants::slope
  double logMByKappa;  ///< KernelWidth::logMByKappa
};

/// Sums of an ellipsoid from the last gradients, from which removalError() follows.
struct Usefulness {
  float phi2;  ///< sum of phi^2
  float rPhi;  ///< sum of r phi
  float edge;  ///< edgeGradient()
};

struct StepArguments {
  std::uint32_t ellipsoidCount;
  MomentSums sums;
  Ellipsoid* ellipsoids;
  AdamState* states;
  PairForm* forms;
  Usefulness* usefulness;
  int* diverged;  ///< is set to 1 if an ellipsoid is not finite
  double radius;  ///< radius of the support in the unit frame
  KernelEdge edge;
  double factor;  ///< factor of the step sizes
  StepSizes sizes;
  AdamOptions adam;
  EllipsoidLimits limits;
  ListedSupport* listed;     ///< an ellipsoid's, in the lists
  double core;               ///< radius within which no list may miss anything
  std::uint32_t* refused;    ///< steps that were refused since the lists were built
  std::uint32_t maxRefused;  ///< number of refused steps that ends the lists
  const int* halted;         ///< flag of isHalted()
  int* halts;                ///< set to 1 where the lists do not serve the next step
};

/// The supports that lists are to hold.
struct ListingArguments {
  std::uint32_t count;
  const Ellipsoid* ellipsoids;
  const AdamState* states;
  ListedSupport* listed;  ///< input: supports in the last lists; output: in the next lists
  double radius;          ///< radius of the support in the unit frame
  SlackRule rule;
};

/// Takes the step. launchMomentSums must have been called before.
void launchStep(const StepArguments& arguments, cudaStream_t stream);
/// Writes the gradients of all ellipsoids. launchMomentSums must have been called before.
void launchReadGradients(const StepArguments& arguments, EllipsoidGradient* out,
                         cudaStream_t stream);

/// Sums the loss of all bricks, in one order.
void launchLossSum(const double* brickLoss, std::uint32_t bricks, double* sum, cudaStream_t stream);

/// Writes listedSupport() of all ellipsoids.
void launchListing(const ListingArguments& arguments, cudaStream_t stream);
/// Sums Usefulness::edge of `count` ellipsoids, always in the same order.
void launchEdgeSum(const Usefulness* usefulness, std::uint32_t count, double* sum,
                   cudaStream_t stream);

struct ShrinkArguments {
  std::uint32_t count;
  Ellipsoid* ellipsoids;
  double factor;                ///< scales are divided by it
  const ListedSupport* listed;  ///< an ellipsoid's, in the lists; null: there are no lists
  double core;                  ///< as in StepArguments
  int* halts;                   ///< set to 1 where the lists do not serve the next step
};
void launchShrink(const ShrinkArguments& arguments, cudaStream_t stream);

struct FormArguments {
  const Ellipsoid* ellipsoids;
  std::uint32_t count;
  double radius;    ///< radius of the support in the unit frame
  PairForm* forms;  ///< output
};
void launchForms(const FormArguments& arguments, cudaStream_t stream);

/// The residuals whose errors are measured.
struct ErrorArguments {
  const float* residual;  ///< kBrickVoxels values for each brick
  const Coord* bricks;
  const BrickMask* active;  ///< active masks of the target bricks
  std::uint32_t brickCount, targetCount;
  Box box;
};

class ErrorSums {
 public:
  explicit ErrorSums(cudaStream_t stream);
  [[nodiscard]] FitErrors sum(const ErrorArguments& arguments);

 private:
  cudaStream_t stream_;
  GrowingBuffer<double> columns_, totals_;
  GrowingBuffer<char> temporary_;
};

}  // namespace esvr::cuda
