#pragma once
/// The state of a fit and the moves it is made of, wherever it is computed; run.h decides which
/// comes when.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "esvr/device.h"
#include "esvr/fit.h"
#include "fit/ellipsoid.h"
#include "fit/target.h"
#include "fit/tuning.h"

namespace esvr {

struct OptimiserOptions {
  Kernel kernel;
  std::uint64_t seed = 1;
  Device device;
  std::optional<std::size_t> maxDeviceBytes;  ///< FitOptions::maxDeviceBytes
};

/// Errors of a fit as its curve reports them, in units of the target.
struct FitErrors {
  double squaredSum = 0.0;        ///< over all bricks
  double squaredSumBox = 0.0;     ///< over the target's box
  double squaredSumActive = 0.0;  ///< over the active voxels
  double largest = 0.0;

  /// Of two parts of a volume.
  void add(const FitErrors& part) {
    squaredSum += part.squaredSum;
    squaredSumBox += part.squaredSumBox;
    squaredSumActive += part.squaredSumActive;
    largest = largest > part.largest ? largest : part.largest;
  }
};

class Optimiser {
 public:
  virtual ~Optimiser() = default;

  /// Adds ellipsoids where the error is, until there are `count`, or no error is left to mend.
  virtual void growTo(std::size_t count) = 0;

  /// Moves `count` ellipsoids whose removal costs least to where the error is.
  virtual void relocate(std::size_t count) = 0;

  /// Gradients and a step of factor times the tuned sizes, for each of the factors.
  /// \return sum of r^2 before the last step
  /// \throws RuntimeFailure  the loss is not finite
  virtual double iterate(std::span<const double> factors) = 0;

  /// How many iterations a call of iterate() should be given, where nothing else comes between.
  [[nodiscard]] virtual std::uint32_t batchSize() const = 0;

  [[nodiscard]] virtual FitErrors measure() = 0;

  /// The kernel as it is now.
  [[nodiscard]] virtual const Kernel& kernel() const = 0;

  /// Sum over the ellipsoids of dL/dkappa at the last gradients, half widths held; 0 before any.
  [[nodiscard]] virtual double kappaSlope() = 0;

  /// Gives all ellipsoids another edge; scales change so that their half widths stay.
  virtual void setKappa(float kappa) = 0;

  /// Drops ellipsoids that no voxel sees. They cost bytes and change nothing.
  virtual void dropUnseen() = 0;

  [[nodiscard]] virtual std::size_t ellipsoidCount() const = 0;
  [[nodiscard]] virtual std::vector<Ellipsoid> ellipsoids() const = 0;
  /// Of the lists last built.
  [[nodiscard]] virtual std::uint64_t pairCount() const = 0;
  /// The most that has been held so far; 0 on the CPU.
  [[nodiscard]] virtual std::size_t deviceBytes() const = 0;
  /// Spent so far on finding where ellipsoids are missing and shaping them.
  [[nodiscard]] virtual double secondsSeeding() const = 0;
};

/// An optimiser on the device of the options. The target must outlive it.
/// \throws DeviceError  that device cannot be used
[[nodiscard]] std::unique_ptr<Optimiser> makeOptimiser(const FitTarget& target,
                                                       const OptimiserOptions& options,
                                                       const Tuning& tuning);

}  // namespace esvr
