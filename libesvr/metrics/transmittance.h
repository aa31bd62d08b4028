#pragma once
/// The transmittance of candidates against one reference, for searches that judge many of them.
/// esvr/metrics.h defines the measure.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "esvr/metrics.h"
#include "esvr/volume.h"

namespace esvr::metrics {

inline constexpr std::size_t kAxes = 3;
inline constexpr std::size_t kTransmittances = 3;  ///< T = 0.9, 0.5 and 0.1

/// The columns of a tile: 8 x 8, at 8 * a + b. a and b are the two other axes in their order.
inline constexpr std::size_t kTileColumns = std::size_t(kBrickSide) * kBrickSide;

/// The position of a row of bricks along an axis: its brick coordinates on the two other axes.
struct TilePlace {
  std::int32_t a = 0, b = 0;
  friend auto operator<=>(const TilePlace&, const TilePlace&) = default;
};

/// For each axis, the tiles in which bricks lie, increasing, and the tile of each brick. There are at
/// most as many tiles as bricks, however large the bounding box.
struct TileLayout {
  Coord origin;
  std::vector<Coord> bricks;
  std::array<std::vector<TilePlace>, kAxes> places;
  std::array<std::vector<std::uint32_t>, kAxes> tileOfBrick;

  explicit TileLayout(const SparseVolume& volume);
  [[nodiscard]] bool isOf(const SparseVolume& volume) const {
    return volume.origin == origin && volume.bricks == bricks;
  }
};

/// kTileColumns depths for each tile of a layout, by axis.
using TileDepths = std::array<std::vector<double>, kAxes>;

/// The light that passes through a column, for each T.
using Transmittances = std::array<double, kTransmittances>;

/// A reference whose depths and transmittances are computed once. A measurement then takes one pass
/// over the candidate's bricks and six exponentials at most for each column. It may be used by
/// several threads at a time.
class TransmittanceReference {
 public:
  /// \param box  default: the active bounding box
  /// \throws BadInput  a value is not finite
  explicit TransmittanceReference(const SparseVolume& reference,
                                  const std::optional<Box>& box = {});

  /// False if the reference has no column of positive depth in the box, or a background above 0. Nothing can be measured
  /// then.
  [[nodiscard]] bool isDefined() const { return medianDepth_ > 0.0; }
  [[nodiscard]] double medianDepth() const { return medianDepth_; }

  /// Measures a volume. It takes less time if its bricks are those of the reference.
  /// \throws BadInput  a value is not finite
  /// \throws UsageError  it is not isDefined()
  [[nodiscard]] TransmittancePsnr measure(const SparseVolume& volume) const;

 private:
  Box box_;
  TileLayout layout_;
  TileDepths depths_;
  std::array<std::vector<Transmittances>, kAxes> transmittances_;  ///< of the columns of depths_
  double medianDepth_ = 0.0;
};

}  // namespace esvr::metrics
