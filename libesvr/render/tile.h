#pragma once
/// A square of pixels, drawn by bins of depth from front to back.

#include <span>
#include <vector>

#include "render/picture.h"
#include "render/primitive_view.h"

namespace esvr {

inline constexpr int kTileSide = 16;  ///< pixels
inline constexpr int kBinSamples =
    32;  ///< samples of a ray that are summed before any is composited

struct TilePlace {
  int column, row;  ///< of its first pixel
};

/// What tiles need of the picture.
struct TileScene {
  const RenderOptions& options;
  const View& view;
  const TransferTable& table;
  const VisiblePrimitives& primitives;
  float background;
};

class Tile {
 public:
  Tile(const TileScene& scene, TilePlace place);

  /// \param primitives  whose bounds overlap the tile, in increasing order
  void draw(std::span<const std::uint32_t> primitives);
  void copyTo(Picture& picture) const;

 private:
  static constexpr int kPixels = kTileSide * kTileSide;

  /// Of a pixel in the plane of the picture, and how far one unit along its ray is: perspective,
  /// the plane is at distance 1 and its corners are farther away than its middle.
  struct RayPlace {
    double x, y, unit;
  };
  /// A primitive and the bins that it may touch.
  struct Entry {
    std::int64_t firstBin, lastBin;
    std::uint32_t primitive;
  };
  struct Cosines {
    double least, most;  ///< of the angles between the tile's rays and forward
  };

  [[nodiscard]] RayPlace rayPlace(int column, int row) const;
  [[nodiscard]] Cosines cosines() const;
  [[nodiscard]] std::vector<Entry> entries(std::span<const std::uint32_t> primitives) const;
  void drawBin(std::int64_t bin, std::span<const Entry> active);
  void addPrimitive(std::int64_t bin, std::uint32_t primitive);
  void addToRay(const PrimitiveView& p, int pixel, double firstDistance);
  void composite();
  [[nodiscard]] bool alive(int pixel) const {
    return !(rays_[pixel].transmittance < scene_.options.minTransmittance);
  }
  [[nodiscard]] bool anyAlive() const;

  const TileScene& scene_;
  TilePlace place_;
  int columns_, rows_;  ///< pixels within the picture
  std::vector<RayPlace> places_;
  std::vector<RayState> rays_;
  std::vector<float> sums_;  ///< kBinSamples a pixel
  /// Which of a pixel's sums something was added to: a bit each, the first sample's the lowest.
  std::vector<std::uint32_t> touched_;
  static_assert(kBinSamples == 32, "one bit a sample");
};

}  // namespace esvr
