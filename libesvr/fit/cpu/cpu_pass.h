#pragma once
/// The pass of the default fit on the CPU: squared errors, and one kernel for all ellipsoids.

#include <span>
#include <vector>

#include "field/support.h"
#include "fit/cpu/pair_pass.h"

namespace esvr {

/// A kernel that all ellipsoids share.
class SceneKernel {
 public:
  explicit SceneKernel(const KernelConstants<double>& kernel);

  [[nodiscard]] const KernelConstants<float>& constants(std::size_t) const { return narrowed_; }
  [[nodiscard]] double radius(std::size_t) const { return radius_; }
  [[nodiscard]] const KernelConstants<double>& exact() const { return exact_; }

 private:
  KernelConstants<double> exact_;
  KernelConstants<float> narrowed_;
  double radius_;
};

class CpuPass : public PairPass<SceneKernel> {
 public:
  CpuPass(const FitTarget& target, const KernelConstants<double>& kernel)
      : PairPass(target, SceneKernel(kernel)) {}

  /// Computes the gradients of 1/2 sum r^2 with r = V - target over all bricks of the lists. If
  /// FitTarget::saturates, V is clamped, and the loss goes on linearly beyond the range: its
  /// derivative by the sum is r there too, so that a sum far beyond the range is pulled back unless
  /// the target is the range's end.
  /// \return sum of r^2
  double gradients(std::span<const Ellipsoid> ellipsoids, std::span<EllipsoidGradient> out);

  /// Sets the kernel; the lists must then be rebuilt.
  void setKernel(const KernelConstants<double>& kernel) { setKernels(SceneKernel(kernel)); }
  [[nodiscard]] const KernelConstants<double>& kernel() const { return kernels().exact(); }

 private:
  std::vector<double> brickLoss_;
};

}  // namespace esvr
