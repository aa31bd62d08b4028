#pragma once
/// Makes stored grids smaller: quantises their ellipsoids, leaves the less important ones out, and corrects signs.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/grid_coding.h"
#include "esvr/quantised.h"
#include "esvr/volume.h"

namespace esvr {

// Compacts a fitted grid. Rate control chooses the quantisation steps; the ellipsoids are
// quantised, and their intensities are solved for again.

struct CompactOptions {
  /// PSNR over the box, in dB, that quantising may lose against the same ellipsoids in float32. With
  /// 0.1 dB, a file is hardly worse than its fit; 0.3 dB would save 2 to 11 % of the bytes.
  double loss = 0.1;
  /// PSNR over the box, in dB, that the smallest result must reach. It replaces `loss`.
  std::optional<double> psnr{};
  /// Bytes that the ellipsoids of the best result may take. It replaces `loss` and `psnr`.
  std::optional<std::uint64_t> bytes{};
  std::optional<Box> box{};      ///< box of the PSNR; default: the active bounding box
  std::optional<double> peak{};  ///< peak of the PSNR, above 0; default: peakOf() of the source
  Device device{};               ///< device that evaluates the trials
  /// How the result finds its active voxels, if the rule of the grid does not suffice any more
  /// (renewActivity); nothing: the rule stays. If `bytes` are given, it stays where another one would
  /// take more bytes.
  std::optional<ActivityOptions> activity{};
  /// The result is made in about the time of three evaluations of the grid: the steps are those with
  /// which a search would begin, or, for `bytes`, the first that fit; the intensities are rounded but
  /// not solved for, and there are no errors of layers. It serves to complete a conversion that was
  /// cancelled. `activity` is ignored.
  bool quick = false;
};

struct CompactResult {
  StoredGrid grid;  ///< the quantised grid; its field is the one that a reader gets
  QuantiserSteps steps;
  double loss = 0.0;        ///< dB; negative if solving for the intensities gained more
  std::uint64_t bytes = 0;  ///< bytes of the ellipsoids
};

/// Compacts a grid. The result is deterministic on one device. Devices round differently, so that
/// they may choose different steps. If the wanted PSNR or size is out of reach, the result is the
/// nearest one found.
/// \param grid  a grid that makeStoredGrid made from `source`; Ellipsoids::kappa must be empty
/// \throws RuntimeFailure  no quantisation lattice can hold the ellipsoids, or each ellipsoid has
///                         its own kappa
/// \throws DeviceError  the GPU cannot be used
[[nodiscard]] CompactResult compactGrid(const StoredGrid& grid, const SparseVolume& source,
                                        const CompactOptions& options = {});

// Coarser levels of detail of a grid: the most important of its ellipsoids.

/// Keeps the first importance layers of a grid and drops its residual. A grid that has no more
/// layers is returned unchanged.
[[nodiscard]] StoredGrid firstLayers(StoredGrid grid, std::size_t layers);

/// Keeps the `count` ellipsoids of the largest weight of a grid, in their order. The weight is
/// |I| sqrt(s1 s2 s3): the root of the ellipsoid's sum of squares over voxels, up to a factor that
/// depends on kappa only. The result has no quantised form, no layers and no residual. A grid that
/// has no more ellipsoids is returned unchanged.
[[nodiscard]] StoredGrid heaviest(StoredGrid grid, std::size_t count);

// A residual corrects the sum of ellipsoids voxel by voxel where its sign is wrong.

/// Corrects the sign of every voxel of a narrow band where the sum has another one than the source,
/// by a residual. A reader on any machine then finds the signs of the source: evaluations on different
/// machines differ by rounding (field.h), and the residual includes a margin for that.
/// \param grid  a narrow band without a residual that makeStoredGrid made from `source`
/// \return the grid without a residual if no sign is wrong
[[nodiscard]] StoredGrid withSigns(StoredGrid grid, const SparseVolume& source);

}  // namespace esvr
