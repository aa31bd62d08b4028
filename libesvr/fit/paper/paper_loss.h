#pragma once
/// The paper's loss, beta * L1 + (1 - beta) * D-SSIM (paper, eq. 7), and its derivative by every
/// voxel of the prediction. D-SSIM is 1 - mean 3D SSIM with the window of ssim_window.h.

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/brick_index.h"
#include "field/ssim_window.h"

namespace esvr {

/// The prediction and the target are zero outside the bricks. Windows are not clipped. The windows
/// around all voxels of space count, or those around the voxels of a box.
struct PaperLossInput {
  const BrickIndex& index;          ///< every brick where prediction or target may be non-zero
  std::span<const float> residual;  ///< prediction - target, kBrickVoxels values for each brick
  std::span<const float> target;    ///< target in the index's first bricks; it is zero in others
  double voxels;                    ///< number of voxels over which the means are taken
  double beta;                      ///< share of L1 in the loss, 0 to 1
  double peak;                      ///< range L of the values, by which they are divided for L1
  std::optional<Box> within{};      ///< box of bricks whose voxels' windows count; default: all
};

/// Derivatives of 1 - SSIM by the windows' weighted means of r, r r and t r, for the windows around
/// a brick's voxels. They are zero for windows that cover neither r nor t. The last two are
/// multiplied by c2, so that they are of order 1 at most. The first is float64, because its sum
/// over the windows of a flat region nearly cancels that of the second.
///
/// With means m, variances v and the prediction p = t + r,
///
///     SSIM = (1 - l) (1 - c),   l = m_r^2 / (m_p^2 + m_t^2 + c1),   c = v_r / (v_p + v_t + c2)
///
/// This form in the residual r has no cancellation for good fits.
struct WindowGradients {
  std::array<double, kBrickVoxels> byR;
  std::array<float, kBrickVoxels> byRr, byTr;
};

/// The values that SSIM compares.
struct SsimValues {
  const BrickIndex& index;
  std::span<const float> residual;  ///< kBrickVoxels values for each brick of the index
  std::span<const float> target;    ///< target in the index's first bricks; it is zero in others
  SsimConstants constants;
};

/// The windows that cover a residual or a target, by brick.
struct Windows {
  BrickIndex index;
  std::vector<Box> supports;  ///< boxes, halo coordinates, outside which r and t are zero
  std::vector<Box> reached;   ///< voxels whose windows overlap `supports`, in whole rows along z
  std::vector<WindowGradients> gradients;
};

/// Evaluates the loss. The time is proportional to the number of bricks and their neighbours:
/// windows that cover no brick have an SSIM of exactly 1. The result is bit-identical for any
/// number of threads, and does not change if bricks of zeros are added to the index. Buffers are
/// kept between calls.
class PaperLoss {
 public:
  /// \param lossByValue  output: derivative of the loss by the prediction, in the layout of the
  ///                     residual; the derivative of L1 is 0 if the residual is 0
  /// \return the loss, which is NaN if a residual is NaN
  /// \throws UsageError  beta is outside [0, 1], or the peak or number of voxels is not positive
  double evaluate(const PaperLossInput& input, std::vector<float>& lossByValue);

 private:
  double absoluteError(const PaperLossInput& input, std::vector<float>& lossByValue);
  void findWindows(const SsimValues& values, const std::optional<Box>& within);
  double dissimilarities(const SsimValues& values);
  void addGradient(const SsimValues& values, double scale, std::vector<float>& lossByValue);
  [[nodiscard]] double sumOfBricks() const;

  std::vector<Box> nonZero_;  // nonZeroBox of each brick of the index
  Windows windows_{BrickIndex(std::span<const Coord>{}), {}, {}, {}};
  std::vector<double> brickSums_;
};

}  // namespace esvr
