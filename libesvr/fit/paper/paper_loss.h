#pragma once
/// The paper's loss, beta * L1 + (1 - beta) * D-SSIM (eq. recon_loss), and its derivative by every
/// voxel of the prediction. D-SSIM is 1 - the mean of 3D SSIM, with the window of ssim_window.h.

#include <optional>
#include <span>
#include <vector>

#include "core/brick_index.h"
#include "fit/paper/ssim_gradient.h"

namespace esvr {

/// Prediction and target are zero outside the bricks, and no window is clipped: those of the voxels
/// of all space count, or those of a box.
struct PaperLossInput {
  const BrickIndex& index;          ///< every brick where prediction or target may be non-zero
  std::span<const float> residual;  ///< prediction - target, kBrickVoxels a brick of the index
  std::span<const float> target;    ///< of the index's first bricks; zero in the others
  double voxels;                    ///< of the box that the means are taken over
  double beta;                      ///< 0..1
  double peak;                      ///< range L of the values; L1 is taken of values divided by it
  std::optional<Box> within{};      ///< in bricks: only the windows of its voxels count
};

/// Costs follow the bricks and those next to them: windows that see no brick count as SSIM 1, which
/// is exact. The same bits for any number of threads, and for bricks of zeros added to the index.
/// Keeps its buffers from one call to the next.
class PaperLoss {
 public:
  /// \param lossByValue  out: the loss's derivative by the prediction, laid out as the residual;
  ///                     0 by L1 where the residual is 0
  /// \return the loss. NaN where a residual is NaN.
  /// \throws UsageError  beta outside [0, 1], peak or number of voxels not positive
  double evaluate(const PaperLossInput& input, std::vector<float>& lossByValue);

 private:
  double absoluteError(const PaperLossInput& input, std::vector<float>& lossByValue);
  void findWindows(const SsimValues& values, const std::optional<Box>& within);
  double dissimilarities(const SsimValues& values);
  void addGradient(const SsimValues& values, double scale, std::vector<float>& lossByValue);
  [[nodiscard]] double sumOfBricks() const;

  std::vector<Box> nonZero_;  // of the index's bricks
  Windows windows_{BrickIndex(std::span<const Coord>{}), {}, {}, {}};
  std::vector<double> brickSums_;
};

}  // namespace esvr
