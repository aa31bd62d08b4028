#pragma once
/// A tile whose samples are interpolated from the voxels that they lie between.

#include "render/tile.h"
#include "render/voxel_window.h"

namespace esvr {

class WindowTile final : public Tile {
 public:
  WindowTile(const TileScene& scene, TilePlace place);

 private:
  /// Samples of a rectangle of the picture's pixels.
  struct Block {
    PixelRectangle pixels;
    double firstSample;
    int samples;
  };
  /// The voxels of a block, and what of the block finds them.
  struct Window {
    VoxelWindow shape;
    WindowOrigin origin;
    Vec3 corner;  ///< the origin, along x, y, z
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
  std::vector<float> values_;  ///< sums, then voxels
  std::vector<char> filled_;   ///< slabs that something was added to
};

}  // namespace esvr
