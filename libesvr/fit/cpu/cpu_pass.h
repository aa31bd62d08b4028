#pragma once
/// One pass of a fit: from ellipsoids to residuals, loss and gradients, brick by brick.

#include <functional>
#include <span>
#include <vector>

#include "field/brick_kernels.h"
#include "field/brick_pairs.h"
#include "fit/adam.h"
#include "fit/cpu/pair_tapes.h"
#include "fit/ellipsoid.h"
#include "fit/target.h"

namespace esvr {

/// Kernels where ellipsoids differ in their edge.
struct OwnKernels {
  std::vector<KernelConstants<float>> constants;
  std::vector<double> radii;  ///< of the supports, in the unit frames
};

/// Keeps the pair lists and the prepared forms. Lists hold while no support has moved by more than
/// the slack they were built with; the caller says when to rebuild.
class CpuPass {
 public:
  CpuPass(const FitTarget& target, const KernelConstants<double>& kernel);

  /// Kernels of the ellipsoids, borrowed; null: all have the engine's. Lists must be rebuilt.
  void useKernels(const OwnKernels* kernels) { ownKernels_ = kernels; }

  /// Builds the lists anew, with supports widened by `slack` voxels.
  void rebuild(std::span<const Ellipsoid> ellipsoids, double slack);

  /// Squared-error pass: gradients of 1/2 sum r^2, r = V - target, over all bricks of the lists.
  /// \return sum of r^2
  double gradients(std::span<const Ellipsoid> ellipsoids, std::span<EllipsoidGradient> out);

  /// Writes r for every brick (targetBricks() first, then those only supports reach).
  void residuals(std::span<const Ellipsoid> ellipsoids, std::vector<float>& out);

  /// Gradients for a loss whose derivative by V is given, kBrickVoxels a brick in residuals' order.
  void gradientsOf(std::span<const Ellipsoid> ellipsoids, std::span<const float> lossByValue,
                   std::span<EllipsoidGradient> out);

  /// Another kernel: lists must be built anew.
  void setKernel(const KernelConstants<double>& kernel);

  [[nodiscard]] const BrickIndex& index() const { return index_; }
  [[nodiscard]] std::size_t targetBricks() const { return target_.bricks.size(); }
  [[nodiscard]] std::size_t brickCount() const { return index_.size(); }
  [[nodiscard]] const BrickPairs& pairs() const { return pairs_; }
  [[nodiscard]] const KernelConstants<double>& kernel() const { return kernel_; }

 private:
  [[nodiscard]] const KernelConstants<float>& kernelOf(std::size_t ellipsoid) const {
    return ownKernels_ ? ownKernels_->constants[ellipsoid] : kernelFloat_;
  }
  [[nodiscard]] double radiusOf(std::size_t ellipsoid) const {
    return ownKernels_ ? ownKernels_->radii[ellipsoid] : radius_;
  }
  void prepare(std::span<const Ellipsoid> ellipsoids);
  void startFromTarget(std::size_t brick, float* r) const;
  void saturate(std::size_t brick, float* r) const;
  void forwardBrick(std::size_t brick, PairTapes& scratch, float* r) const;
  void backwardBrick(std::size_t brick, const PairTapes& scratch, const float* r);
  void reduce(std::span<const Ellipsoid> ellipsoids, std::span<EllipsoidGradient> out) const;

  const FitTarget& target_;
  KernelConstants<double> kernel_;
  KernelConstants<float> kernelFloat_;
  double radius_;
  const OwnKernels* ownKernels_ = nullptr;
  BrickIndex index_;
  BrickPairs pairs_;
  std::vector<LineForm> forms_;
  std::vector<Coord> frames_;  ///< origin of a form's center: near it, so that float32 holds
  std::vector<PairMoments> moments_;
  std::vector<double> brickLoss_;
};

}  // namespace esvr
