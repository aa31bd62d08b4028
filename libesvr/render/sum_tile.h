#pragma once
/// A tile whose samples are values of the sum of ellipsoids (Between::kSum).

#include "render/tile.h"

namespace esvr {

class SumTile final : public Tile {
 public:
  SumTile(const TileScene& scene, TilePlace place);

 private:
  void drawBin(std::int64_t bin, std::span<const Entry> active) override;
  void addEllipsoid(std::int64_t bin, std::uint32_t ellipsoid);
  /// An ellipsoid, and its position relative to the tile's first pixel and a bin's first sample.
  /// The members are those that spanOn() (ray_math.h) takes.
  struct PlacedEllipsoid {
    const EllipsoidView& view;
    float column, row, middleAhead;
  };
  [[nodiscard]] PlacedEllipsoid placed(const EllipsoidView& p, std::int64_t bin) const;
  void addToRay(const PlacedEllipsoid& p, int column, int row);
  void compositeRay(int pixel, double firstSample);

  double middleUnit_;  ///< samples per unit of depth, on the ray through the middle of the tile
  std::vector<RayScale> scales_;
  std::vector<float> sums_;  ///< kBinSamples sums for each pixel
  /// For each pixel a bit for each of its sums, set if an ellipsoid was added. Bit 0 is the first
  /// sample.
  std::vector<std::uint32_t> touched_;
  static_assert(kBinSamples == 32, "one bit a sample");
};

}  // namespace esvr
