#pragma once
/// The interface of a fit's state and its operations on any device; run.h decides their order.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "esvr/device.h"
#include "esvr/fit.h"
#include "fit/adam.h"
#include "fit/target.h"
#include "fit/tuning.h"

namespace esvr {

struct OptimiserOptions {
  Kernel kernel;
  std::uint64_t seed = 1;
  Device device;
  std::optional<std::size_t> maxDeviceBytes;  ///< see CommonFitOptions
};

/// Errors of a fit for its curve, in units of the target.
struct FitErrors {
  double squaredSum = 0.0;        ///< sum of squares over all bricks
  double squaredSumBox = 0.0;     ///< sum of squares over the target's box
  double squaredSumActive = 0.0;  ///< sum of squares over the active voxels
  double largest = 0.0;           ///< largest absolute error

  /// Adds the errors of another part of the volume.
  void add(const FitErrors& part) {
    squaredSum += part.squaredSum;
    squaredSumBox += part.squaredSumBox;
    squaredSumActive += part.squaredSumActive;
    largest = largest > part.largest ? largest : part.largest;
  }
};

/// The ellipsoids of a fit and the moments of their gradients, with which it can continue.
struct FitState {
  std::vector<Ellipsoid> ellipsoids;
  std::vector<AdamState> adam;  ///< one for each ellipsoid
};

/// The state of ellipsoids that have taken no step.
[[nodiscard]] inline FitState stateOf(std::vector<Ellipsoid> ellipsoids) {
  std::vector<AdamState> adam(ellipsoids.size());
  return {std::move(ellipsoids), std::move(adam)};
}

class Optimiser {
 public:
  virtual ~Optimiser() = default;

  /// Continues from a state.
  virtual void setState(const FitState& state) = 0;
  [[nodiscard]] virtual FitState state() const = 0;

  /// Replaces the ellipsoids. The new ones have taken no step yet.
  virtual void setEllipsoids(std::span<const Ellipsoid> ellipsoids) = 0;

  /// Adds seeds at voxels of large error until there are `count` ellipsoids or no error is left.
  virtual void growTo(std::size_t count) = 0;

  /// Replaces the `count` ellipsoids whose removal adds the smallest error by seeds at voxels of
  /// large error.
  virtual void relocate(std::size_t count) = 0;

  /// Makes an iteration (gradients and a step) for each factor of the tuned step sizes.
  /// \return sum of r^2 before the last step
  /// \throws RuntimeFailure  the loss is not finite
  virtual double iterate(std::span<const double> factors) = 0;

  /// The best number of iterations for one call of iterate().
  [[nodiscard]] virtual std::uint32_t batchSize() const = 0;

  [[nodiscard]] virtual FitErrors measure() = 0;
  /// The same where an iteration follows, which may then share the pass over the bricks.
  [[nodiscard]] virtual FitErrors measureBeforeIteration() { return measure(); }

  /// The current kernel.
  [[nodiscard]] virtual const Kernel& kernel() const = 0;

  /// Sum over the ellipsoids of dL/dkappa at fixed half widths, by the last gradients; 0 before the
  /// first iteration.
  [[nodiscard]] virtual double kappaSlope() = 0;

  /// Changes the edge of all ellipsoids, and their scales so that their half widths stay the same.
  virtual void setKappa(float kappa) = 0;

  /// Drops ellipsoids that contribute to no voxel.
  virtual void dropUnseen() = 0;

  [[nodiscard]] virtual std::size_t ellipsoidCount() const = 0;
  [[nodiscard]] virtual std::vector<Ellipsoid> ellipsoids() const = 0;
  /// Pairs in the lists that were built last.
  [[nodiscard]] virtual std::uint64_t pairCount() const = 0;
  /// Largest GPU memory held so far; 0 on the CPU.
  [[nodiscard]] virtual std::size_t deviceBytes() const = 0;
  /// \return true if GPU memory ran out, so that there are fewer ellipsoids than were asked for
  [[nodiscard]] virtual bool deviceFull() const { return false; }
  /// Seconds spent so far on making seeds.
  [[nodiscard]] virtual double secondsSeeding() const = 0;
};

/// Makes an optimiser on the device of the options. The target must outlive it.
/// \throws DeviceError  the device cannot be used
[[nodiscard]] std::unique_ptr<Optimiser> makeOptimiser(const FitTarget& target,
                                                       const OptimiserOptions& options,
                                                       const Tuning& tuning);

}  // namespace esvr
