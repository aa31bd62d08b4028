#pragma once
/// The pass of the paper's method on the CPU: the derivative of the loss by every voxel is given,
/// and ellipsoids may each have a kernel of their own.

#include <span>
#include <vector>

#include "fit/cpu/pair_pass.h"

namespace esvr::paper {

/// The kernels of a population: one for all, or one for each ellipsoid where k is learned.
struct PopulationKernels {
  std::vector<KernelConstants<float>> all;
  std::vector<double> radii;  ///< of the supports, in the unit frames

  [[nodiscard]] const KernelConstants<float>& constants(std::size_t i) const {
    return all[all.size() == 1 ? 0 : i];
  }
  [[nodiscard]] double radius(std::size_t i) const { return radii[radii.size() == 1 ? 0 : i]; }
};

/// Borrows the kernels, which change with every step.
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
  /// Target and kernels must outlive the pass.
  CpuPaperPass(const FitTarget& target, const PopulationKernels& kernels)
      : PairPass(target, BorrowedKernels(kernels)) {}

  /// Gradients of a loss whose derivative by V is given, kBrickVoxels a brick in residuals' order.
  void gradients(std::span<const Ellipsoid> ellipsoids, std::span<const float> lossByValue,
                 std::span<EllipsoidGradient> out);
};

}  // namespace esvr::paper
