#pragma once
/// The pass of the paper's method on the CPU: the derivative of the loss by every voxel is given,
/// and each ellipsoid may have its own kernel.

#include <span>
#include <vector>

#include "fit/cpu/pair_pass.h"

namespace esvr::paper {

/// The kernels of a population: one for all, or one for each ellipsoid if k is learned.
struct PopulationKernels {
  std::vector<KernelConstants<float>> all;
  std::vector<double> radii;  ///< radii of the supports in the unit frame

  [[nodiscard]] const KernelConstants<float>& constants(std::size_t i) const {
    return all[all.size() == 1 ? 0 : i];
  }
  [[nodiscard]] double radius(std::size_t i) const { return radii[radii.size() == 1 ? 0 : i]; }
};

/// A reference to kernels, which change with every step.
class BorrowedKernels {
 public:
  explicit BorrowedKernels(const PopulationKernels& kernels) : kernels_(&kernels) {}
  [[nodiscard]] const KernelConstants<float>& constants(std::size_t i) const {
    return kernels_->constants(i);
  }
  [[nodiscard]] double radius(std::size_t i) const { return kernels_->radius(i); }

 private:
  const PopulationKernels* kernels_;
};

class CpuPaperPass : public PairPass<BorrowedKernels> {
 public:
  /// The target and the kernels must outlive the pass.
  CpuPaperPass(const FitTarget& target, const PopulationKernels& kernels)
      : PairPass(target, BorrowedKernels(kernels)) {}

  /// Computes the gradients of a loss from its derivative by V.
  /// \param lossByValue  kBrickVoxels values for each brick, in the order of residuals()
  void gradients(std::span<const Ellipsoid> ellipsoids, std::span<const float> lossByValue,
                 std::span<EllipsoidGradient> out);
};

}  // namespace esvr::paper
