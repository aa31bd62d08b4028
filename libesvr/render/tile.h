#pragma once
/// A tile is a square of pixels that is drawn together. Its samples are divided by depth into bins,
/// which are drawn from front to back.

#include <memory>
#include <span>
#include <vector>

#include "field/voxel_rule.h"
#include "render/ellipsoid_view.h"
#include "render/picture.h"
#include "render/ray_box.h"

namespace esvr {

inline constexpr int kTileSide = 16;  ///< pixels

struct TilePlace {
  int column, row;  ///< first pixel of the tile
};

/// The parameters that all tiles of a picture share.
struct TileScene {
  const RenderOptions& options;
  const View& view;
  const VisibleEllipsoids& ellipsoids;
  const std::vector<Vec3>& origins;  ///< origins of the chunks
  SampleRule rule;
  VoxelRule voxelRule;
};

class Tile {
 public:
  Tile(const TileScene& scene, TilePlace place);
  Tile(const Tile&) = delete;
  Tile& operator=(const Tile&) = delete;
  virtual ~Tile() = default;

  /// \param ellipsoids  numbers of the ellipsoids whose bounds overlap the tile, increasing
  void draw(std::span<const std::uint32_t> ellipsoids);
  void copyTo(Picture& picture) const;

 protected:
  static constexpr int kPixels = kTileSide * kTileSide;

  /// An ellipsoid and the bins that it may touch.
  struct Entry {
    BinRange bins;
    std::uint32_t ellipsoid;
  };
  virtual void drawBin(std::int64_t bin, std::span<const Entry> active) = 0;

  [[nodiscard]] bool alive(int pixel) const { return scene_.rule.open(rays_[pixel]); }
  void add(int pixel, float value, double number);

  const TileScene& scene_;
  TilePlace place_;
  int columns_, rows_;  ///< pixels within the picture

 private:
  [[nodiscard]] std::vector<Entry> entries(std::span<const std::uint32_t> ellipsoids) const;
  [[nodiscard]] bool anyAlive() const;

  std::vector<SampleRange> clips_;
  std::vector<RayState> rays_;
};

}  // namespace esvr
