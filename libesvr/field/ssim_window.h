#pragma once
/// The Gaussian window of SSIM (Wang et al. 2004) and its sums over the voxels around a brick: the halo of
/// a brick, the inner loops, the sums, and the bricks whose windows reach a set of bricks.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/brick_index.h"
#include "esvr/volume.h"

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

/// The numbers in an index of a brick and its 26 neighbours, z fastest, with the brick itself in
/// the middle; BrickIndex::kNone for missing bricks.
using BricksAround = std::array<std::uint32_t, 27>;
[[nodiscard]] BricksAround bricksAround(const BrickIndex& index, Coord brick);

/// The smallest box of halo coordinates outside which all values are zero.
/// \param boxes  for each brick of the index, a box of local coordinates outside which it is zero
[[nodiscard]] Box haloSupport(const BricksAround& around, std::span<const Box> boxes);

/// The values of the 27 bricks, kBrickVoxels each; null for bricks that are zero.
template <class Value>
using ValuesAround = std::array<const Value*, 27>;

/// Fills a halo with the values as float64, so that window sums of their products are precise.
/// \param seen  halo coordinates to fill, which is extended to whole rows along z
void fillHalo(const ValuesAround<float>& bricks, const Box& seen, HaloValues& out);
void fillHalo(const ValuesAround<double>& bricks, const Box& seen, HaloValues& out);

/// The inner loops over SSIM windows. They are compiled once for each instruction set and chosen at
/// run time (brick_kernels.inl and brick_kernels.cpp).
struct SsimKernels {
  const char* name;
  /// Computes out[i] = sum over t of weights[t] * in[i + t * stride] for i from 0 to count - 1,
  /// with the kSsimTaps weights of a symmetric window. `in` and `out` must not overlap.
  void (*sumTaps)(const double* weights, const double* in, int stride, double* out, int count);
  /// Does the same along rows of kHaloSide values, whose results are rows of kBrickSide values.
  void (*sumRows)(const double* weights, const double* in, double* out, int rows);
  void (*multiply)(const double* a, const double* b, double* product, int count);
};

/// The kernels for the best instruction set of this processor.
[[nodiscard]] const SsimKernels& ssimKernels();

/// The kernels for all instruction sets that this processor has, the best first.
[[nodiscard]] std::vector<const SsimKernels*> runnableSsimKernels();

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

/// Grows a set of bricks by one in every direction, as far as windows reach.
/// \param bricks  in strictly increasing order
/// \return the bricks and their 26 neighbours each, in strictly increasing order
[[nodiscard]] std::vector<Coord> dilateBricks(std::span<const Coord> bricks);

}  // namespace esvr
