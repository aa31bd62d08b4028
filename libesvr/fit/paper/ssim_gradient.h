#pragma once
/// The sum of 1 - SSIM over all windows of a sparse prediction, and its derivative by every voxel.
/// The windows are evaluated first, then the derivatives by the values, both brick by brick.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/brick_index.h"
#include "field/brick_halo.h"
#include "field/ssim_window.h"

namespace esvr {

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

/// Bounding box of a brick's voxels at which the residual or the target is not zero.
[[nodiscard]] Box nonZeroBox(const SsimValues& values, std::size_t brick);

/// The windows that cover a residual or a target, by brick.
struct Windows {
  BrickIndex index;
  std::vector<Box> supports;  ///< boxes, halo coordinates, outside which r and t are zero
  std::vector<Box> reached;   ///< voxels whose windows overlap `supports`, in whole rows along z
  std::vector<WindowGradients> gradients;
};

/// Evaluates the windows around the voxels of one brick, with the buffers of one thread.
class WindowSide {
 public:
  /// \param extent  Windows::supports and Windows::reached of the brick
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

/// Evaluates the derivatives by the values of one brick, with the buffers of one thread. Because
/// the window is symmetric, a value's weights in the windows around it are those of its own window.
class ValueSide {
 public:
  /// \param brick    number of the brick in the index of the values
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
