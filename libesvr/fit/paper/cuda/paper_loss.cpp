#include "fit/paper/cuda/paper_loss.h"

#include <numeric>
#include <vector>

#include "core/cuda/copy.h"

namespace esvr::cuda {
namespace {

double sumOf(const double* device, std::size_t count, cudaStream_t stream) {
  std::vector<double> values(count);
  downloadTo(std::span<double>(values), device, stream);
  return std::accumulate(values.begin(), values.end(), 0.0);
}

}  // namespace

PaperLoss::PaperLoss(cudaStream_t stream)
    : stream_(stream),
      byR_(stream),
      windowLoss_(stream),
      valueLoss_(stream),
      byRr_(stream),
      byTr_(stream),
      lossByValue_(stream) {}

SsimPassArguments PaperLoss::passArguments(const PaperLossArguments& a) {
  const std::size_t windowVoxels = a.windows.size() * kBrickVoxels;
  return {.values = a.bricks.view(),
          .valueCount = std::uint32_t(a.bricks.size()),
          .targetCount = std::uint32_t(a.targetBricks),
          .residual = a.residual,
          .target = a.target,
          .windows = a.windows.view(),
          .windowCount = std::uint32_t(a.windows.size()),
          .weights = weights_,
          .constants = ssimConstants(a.peak),
          .absoluteScale = a.beta / (a.voxels * a.peak),
          .ssimScale = (1.0 - a.beta) / a.voxels,
          .byR = byR_.reserve(windowVoxels),
          .byRr = byRr_.reserve(windowVoxels),
          .byTr = byTr_.reserve(windowVoxels),
          .windowLoss = windowLoss_.reserve(a.windows.size()),
          .valueLoss = valueLoss_.reserve(a.bricks.size()),
          .lossByValue = lossByValue_.reserve(a.bricks.size() * kBrickVoxels)};
}

const float* PaperLoss::derivative(const PaperLossArguments& a) {
  const SsimPassArguments pass = passArguments(a);
  const bool dissimilar = pass.ssimScale != 0.0;
  windowShares_ = dissimilar ? pass.windowCount : 0;
  valueShares_ = pass.valueCount;
  if (dissimilar) launchWindowSide(pass, stream_);
  launchValueSide(pass, stream_);
  return pass.lossByValue;
}

double PaperLoss::loss() const {
  return sumOf(valueLoss_.data(), valueShares_, stream_) +
         sumOf(windowLoss_.data(), windowShares_, stream_);
}

double PaperLoss::bytesFor(double bricks) {
  // Bricks with windows for each brick of values: 27 for a single brick, close to 1 in dense
  // volumes, about 4 for surfaces and tubes.
  constexpr double kWindowBricks = 6.0;
  return bricks * kBrickVoxels *
         (sizeof(float) + kWindowBricks * (sizeof(double) + 2 * sizeof(float)));
}

}  // namespace esvr::cuda
