#pragma once
/// A tile whose samples are interpolated between voxels (Between::kVoxels).

#include "render/tile.h"
#include "render/voxel_window.h"

namespace esvr {

class WindowTile final : public Tile {
 public:
  WindowTile(const TileScene& scene, TilePlace place);

 private:
  /// A range of samples on the rays of a rectangle of pixels.
  struct Block {
    PixelRectangle pixels;
    double firstSample;
    int samples;
  };
  /// The voxel window of a block.
  struct Window {
    VoxelWindow shape;
    WindowOrigin origin;
    Vec3 corner;  ///< the origin in the order x, y, z
  };
  void drawBin(std::int64_t bin, std::span<const Entry> active) override;
  void drawBlock(const Block& block, std::span<const Entry> active);
  void drawParts(const Block& block, std::span<const Entry> active);
  void layOut(const RayBundle& bundle, const VoxelWindow& shape);
  [[nodiscard]] bool addForm(const WindowForm& form);
  [[nodiscard]] bool addRow(const WindowForm& form, const WindowPlace& center, int slab, int row);
  void finishVoxels();
  void drawRay(const Block& block, int column, int row);

  Window window_{};
  std::vector<WindowSlab> slabs_;
  std::vector<float> values_;  ///< sums of ellipsoids; later the voxels that they become
  std::vector<char> filled_;   ///< 1 for slabs that an ellipsoid was added to
};

}  // namespace esvr
