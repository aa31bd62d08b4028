#pragma once
/// The optimiser of the paper's method on the CPU.

#include <vector>

#include "fit/paper/cpu_paper_pass.h"
#include "fit/paper/paper_loss.h"
#include "fit/paper/paper_optimiser.h"

namespace esvr::paper {

class CpuPaperOptimiser final : public PaperOptimiser {
 public:
  CpuPaperOptimiser(const FitTarget& target, const PaperOptions& options);

  [[nodiscard]] std::size_t subvolumeCount() const override { return parts_.size(); }
  void iterate(std::size_t subvolume, const PaperStep& step) override;
  [[nodiscard]] LossGradients gradients(std::size_t subvolume) override;
  void put(const Population& population) override;
  [[nodiscard]] Population population() const override { return population_; }
  [[nodiscard]] std::size_t ellipsoidCount() const override { return population_.size(); }
  [[nodiscard]] FitErrors measure() override;
  [[nodiscard]] std::uint64_t pairCount() const override { return pairCount_; }
  [[nodiscard]] std::size_t deviceBytes() const override { return 0; }

 private:
  struct Part {
    std::unique_ptr<Subvolume> volume;
    CpuPaperPass pass;
    double motionLeft = -1.0;  ///< voxels by which supports may still move; < 0: lists are outdated
  };

  void resizeKernels(std::size_t count);
  void setKernel(std::size_t i, const KernelConstants<double>& kernel);
  void formEllipsoids();
  void rebuildLists(Part& part, double slack);
  double takeGradients(Part& part);
  [[nodiscard]] PaperVector gradientOf(std::size_t ellipsoid) const;

  PaperOptions options_;
  PopulationKernels kernels_;
  std::vector<Part> parts_;
  Population population_;
  std::vector<Ellipsoid> ellipsoids_;  ///< the population in the form of the passes
  std::vector<EllipsoidGradient> gradients_;
  std::vector<float> residuals_, lossByValue_;
  PaperLoss loss_;
  std::uint64_t pairCount_ = 0;
};

}  // namespace esvr::paper
