#pragma once
/// Turns moments into gradients and takes a step. One thread writes each ellipsoid.

#include <cuda_runtime_api.h>

#include "fit/adam.h"
#include "fit/cuda/moment_sums.h"
#include "fit/listed_support.h"
#include "fit/parameter_gradient.h"

namespace esvr::cuda {

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

/// All pointers are to device memory that the caller owns.
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

/// The supports that lists are to hold. Pointers are to device memory, borrowed.
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

/// Pointers are to device memory, borrowed.
struct ShrinkArguments {
  std::uint32_t count;
  Ellipsoid* ellipsoids;
  double factor;                ///< scales are divided by it
  const ListedSupport* listed;  ///< an ellipsoid's, in the lists; null: there are no lists
  double core;                  ///< as in StepArguments
  int* halts;                   ///< set to 1 where the lists do not serve the next step
};
void launchShrink(const ShrinkArguments& arguments, cudaStream_t stream);

/// Pointers are to device memory, borrowed.
struct FormArguments {
  const Ellipsoid* ellipsoids;
  std::uint32_t count;
  double radius;    ///< radius of the support in the unit frame
  PairForm* forms;  ///< output
};
void launchForms(const FormArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
