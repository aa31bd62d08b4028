#pragma once
/// Makes a fitted grid small: quantises its ellipsoids, with bits chosen by what they cost and
/// bring, and solves for the intensities anew.

#include <cstdint>
#include <optional>

#include "esvr/container.h"
#include "esvr/coord.h"
#include "esvr/device.h"
#include "esvr/quantised.h"
#include "esvr/sparse_volume.h"

namespace esvr {

struct CompactOptions {
  static constexpr double kDefaultLoss = 0.1;

  /// dB of PSNR over the box that quantising may cost, against the same ellipsoids in float32.
  double loss = kDefaultLoss;
  std::optional<double> psnr{};  ///< dB over the box: instead of `loss`, as small as reaches this
  std::optional<std::uint64_t> bytes{};  ///< of the ellipsoids: instead of both, as good as fits
  std::optional<Box> box{};              ///< default: the active bounding box
  Device device{};                       ///< that tries the bits out
};

struct CompactResult {
  StoredGrid grid;  ///< `quantised` is set, its field is what a reader gets
  QuantiserSteps steps;
  double loss = 0.0;        ///< dB; below 0 where solving for the intensities gained more
  std::uint64_t bytes = 0;  ///< of the ellipsoids
};

/// Deterministic; devices round differently, and may come to other bits. Where the PSNR or the size
/// asked for is out of reach, the result is as near as rounding comes.
/// \param grid  as makeStoredGrid made it from `source`; without kappas of each ellipsoid
/// \throws RuntimeFailure  ellipsoids that no lattice holds; DeviceError  the GPU cannot be used
[[nodiscard]] CompactResult compactGrid(const StoredGrid& grid, const SparseVolume& source,
                                        const CompactOptions& options = {});

}  // namespace esvr
