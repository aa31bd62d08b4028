#pragma once
/// A square of pixels, drawn by bins of depth from front to back.

#include <span>
#include <vector>

#include "render/picture.h"
#include "render/primitive_view.h"
#include "render/ray_box.h"

namespace esvr {

inline constexpr int kTileSide = 16;  ///< pixels

struct TilePlace {
  int column, row;  ///< of its first pixel
};

/// What tiles need of the picture.
struct TileScene {
  const RenderOptions& options;
  const View& view;
  const VisiblePrimitives& primitives;
  SampleRule rule;
};

class Tile {
 public:
  Tile(const TileScene& scene, TilePlace place);

  /// \param primitives  whose bounds overlap the tile, in increasing order
  void draw(std::span<const std::uint32_t> primitives);
  void copyTo(Picture& picture) const;

 private:
  static constexpr int kPixels = kTileSide * kTileSide;

  /// A primitive and the bins that it may touch.
  struct Entry {
    BinRange bins;
    std::uint32_t primitive;
  };
  void lookAlong(int column, int row, int pixel);
  [[nodiscard]] std::vector<Entry> entries(std::span<const std::uint32_t> primitives) const;
  void drawBin(std::int64_t bin, std::span<const Entry> active);
  void addPrimitive(std::int64_t bin, std::uint32_t primitive);
  /// A primitive and where it lies from the tile's first pixel and a bin's first sample.
  struct PlacedPrimitive {
    const PrimitiveView& view;
    float column, row, middleAhead;
  };
  [[nodiscard]] PlacedPrimitive placed(const PrimitiveView& p, std::int64_t bin) const;
  void addToRay(const PlacedPrimitive& p, int column, int row);
  void composite(std::int64_t bin);
  void compositeRay(int pixel, double firstSample);
  [[nodiscard]] bool alive(int pixel) const { return scene_.rule.open(rays_[pixel]); }
  [[nodiscard]] bool anyAlive() const;

  const TileScene& scene_;
  TilePlace place_;
  int columns_, rows_;  ///< pixels within the picture
  double middleUnit_;   ///< samples for each unit along forward, on the ray of the tile's middle
  std::vector<RayScale> scales_;
  std::vector<SampleRange> clips_;
  std::vector<RayState> rays_;
  std::vector<float> sums_;  ///< kBinSamples a pixel
  /// Which of a pixel's sums something was added to: a bit each, the first sample's the lowest.
  std::vector<std::uint32_t> touched_;
  static_assert(kBinSamples == 32, "one bit a sample");
};

}  // namespace esvr
