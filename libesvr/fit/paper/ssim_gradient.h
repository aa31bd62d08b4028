#pragma once
/// The sum of 1 - SSIM over all windows of a sparse prediction, and its derivative by every voxel:
/// first the windows, then the values, each side by the brick.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/brick_index.h"
#include "field/brick_halo.h"
#include "field/ssim_window.h"

namespace esvr {

/// With means m, variances v and prediction p = t + r, SSIM = (1 - l)(1 - c) where
///     l = m_r^2 / (m_p^2 + m_t^2 + c1),   c = v_r / (v_p + v_t + c2):
/// in the residual r nothing cancels where a fit is good.
///
/// The derivatives of 1 - SSIM by the windows' weighted means of r, r r and t r, for the windows
/// around a brick's voxels; zero where a window sees neither r nor t. The last two are multiplied
/// by c2: so they are of order 1 at most. The first stays float64: in flat regions its sum over
/// windows nearly cancels the second's.
struct WindowGradients {
  std::array<double, kBrickVoxels> byR;
  std::array<float, kBrickVoxels> byRr, byTr;
};

/// What SSIM is taken of.
struct SsimValues {
  const BrickIndex& index;
  std::span<const float> residual;  ///< kBrickVoxels a brick of the index
  std::span<const float> target;    ///< of the index's first bricks; zero in the others
  SsimConstants constants;
};

/// The smallest box of a brick's voxels where residual or target is not zero.
[[nodiscard]] Box nonZeroBox(const SsimValues& values, std::size_t brick);

/// The windows that see a residual or a target, by the brick.
struct Windows {
  BrickIndex index;
  std::vector<Box> supports;  ///< halo coordinates outside which residual and target are zero
  std::vector<Box> reached;   ///< voxels whose windows see that; rows along z whole
  std::vector<WindowGradients> gradients;
};

/// One thread's work on the windows around the voxels of one brick.
class WindowSide {
 public:
  /// \param extent  of Windows: supports and reached
  /// \return the sum of 1 - SSIM
  double evaluate(const SsimValues& values, Coord brick, const SsimWindow::Extent& extent,
                  WindowGradients& out);

 private:
  double differentiate(const SsimConstants& constants, const Box& voxels,
                       WindowGradients& out) const;

  SsimWindow window_;
  HaloValues t_, r_;
  BrickSums sumT_, sumTt_, sumR_, sumRr_, sumTr_;
};

/// One thread's work on the derivatives by the values of one brick. The window is symmetric: so a
/// value's weights in the windows around it are those of its own window.
class ValueSide {
 public:
  /// \param brick    position in the index of the values
  /// \param nonZero  nonZeroBox of the brick
  /// \return derivatives of the sum of 1 - SSIM, valid until the next call
  const BrickSums& evaluate(const SsimValues& values, std::size_t brick, const Box& nonZero,
                            const Windows& windows);

 private:
  template <class Value>
  void sum(const ValuesAround<Value>& values, const SsimWindow::Extent& extent, BrickSums& out);
  void addProducts(const SsimValues& values, std::size_t brick, const Box& nonZero);

  SsimWindow window_;
  HaloValues halo_;
  BrickSums byR_, byRr_, byTr_;
};

}  // namespace esvr
