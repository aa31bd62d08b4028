#pragma once
/// The Gaussian window of SSIM (Wang et al. 2004) and its sums over the voxels around a brick.

#include <array>
#include <cstdint>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"
#include "field/ssim_kernels.h"

namespace esvr {

inline constexpr int kSsimRadius = 5;
inline constexpr int kSsimTaps = 2 * kSsimRadius + 1;
inline constexpr double kSsimSigma = 1.5;

/// The constants (K1 L)^2 and (K2 L)^2 of SSIM, for values with the range L.
struct SsimConstants {
  double c1, c2;
};
[[nodiscard]] SsimConstants ssimConstants(double peak);

/// Side of the halo, which is a brick with the voxels around it that its windows reach, z fastest.
inline constexpr int kHaloSide = kBrickSide + 2 * kSsimRadius;
inline constexpr int kHaloVoxels = kHaloSide * kHaloSide * kHaloSide;
inline constexpr Box kWholeHalo{{0, 0, 0}, {kHaloSide - 1, kHaloSide - 1, kHaloSide - 1}};
inline constexpr Box kWholeBrick{{0, 0, 0}, {kBrickSide - 1, kBrickSide - 1, kBrickSide - 1}};
using HaloValues = std::array<double, kHaloVoxels>;
using BrickSums = std::array<double, kBrickVoxels>;

constexpr int haloOffset(int x, int y, int z) { return (x * kHaloSide + y) * kHaloSide + z; }

/// The weights along one axis, whose sum is 1.
[[nodiscard]] std::array<double, kSsimTaps> ssimWeights();

/// The voxels of the brick whose windows overlap a box of halo coordinates; empty if the box is.
[[nodiscard]] Box windowsThatSee(const Box& halo);
/// The halo coordinates that the windows around a box of the brick's voxels overlap.
[[nodiscard]] Box seenByWindows(const Box& voxels);

/// Computes the weighted sums of the windows around a brick's voxels, axis by axis.
class SsimWindow {
 public:
  SsimWindow() : weights_(ssimWeights()) {}

  /// Limits of a computation; the time depends on them.
  struct Extent {
    Box support;  ///< halo coordinates outside which every value is zero
    Box voxels;   ///< the brick's voxels whose sums are wanted; rows along z are summed whole

    /// The halo coordinates that are read, in whole rows along z. All their values must be given.
    [[nodiscard]] Box read() const;
  };
  /// Sums the values. The result has the same bits for every support that contains the values.
  /// \param out  sums in voxelOffset order; undefined outside extent.voxels
  void sum(const HaloValues& values, const Extent& extent, BrickSums& out);
  /// Sums the products of two halos.
  void sumProducts(const HaloValues& a, const HaloValues& b, const Extent& extent, BrickSums& out);

  /// Sum along one axis of the weights at positions in [low, high], for a window around `at`. A
  /// window that is clipped at the border of a box is divided by it.
  [[nodiscard]] double weightWithin(std::int64_t at, std::int64_t low, std::int64_t high) const;

 private:
  void alongX(const HaloValues& values, const Extent& extent);
  void alongY(const Box& voxels);
  void alongZ(const Box& voxels, BrickSums& out) const;

  const SsimKernels& kernels_ = ssimKernels();
  std::array<double, kSsimTaps> weights_;
  HaloValues products_{};
  std::array<double, kBrickSide * kHaloSide * kHaloSide> sumsX_{};
  std::array<double, kBrickSide * kBrickSide * kHaloSide> sumsXy_{};
};

}  // namespace esvr
