#pragma once
/// A tile whose samples are the sum of ellipsoids itself.

#include "render/tile.h"

namespace esvr {

class SumTile final : public Tile {
 public:
  SumTile(const TileScene& scene, TilePlace place);

 private:
  void drawBin(std::int64_t bin, std::span<const Entry> active) override;
  void addEllipsoid(std::int64_t bin, std::uint32_t ellipsoid);
  /// An ellipsoid and where it lies from the tile's first pixel and a bin's first sample.
  struct PlacedEllipsoid {
    const EllipsoidView& view;
    float column, row, middleAhead;
  };
  [[nodiscard]] PlacedEllipsoid placed(const EllipsoidView& p, std::int64_t bin) const;
  void addToRay(const PlacedEllipsoid& p, int column, int row);
  void compositeRay(int pixel, double firstSample);

  double middleUnit_;  ///< samples for each unit along forward, on the ray of the tile's middle
  std::vector<RayScale> scales_;
  std::vector<float> sums_;  ///< kBinSamples a pixel
  /// A bit for each of a pixel's sums, set where something was added; the first sample's is the
  /// lowest.
  std::vector<std::uint32_t> touched_;
  static_assert(kBinSamples == 32, "one bit a sample");
};

}  // namespace esvr
