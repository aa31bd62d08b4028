#pragma once
/// A tile whose samples are interpolated from the voxels that they lie between.

#include "render/lattice_window.h"
#include "render/tile.h"

namespace esvr {

class LatticeTile final : public Tile {
 public:
  LatticeTile(const TileScene& scene, TilePlace place);

 private:
  /// Samples of a rectangle of the picture's pixels.
  struct Block {
    PixelRectangle pixels;
    double firstSample;
    int samples;
  };
  /// The voxels of a block, and what of the block finds them.
  struct Window {
    LatticeWindow shape;
    LatticeOrigin origin;
    Vec3 corner;  ///< the origin, along x, y, z
  };
  void drawBin(std::int64_t bin, std::span<const Entry> active) override;
  void drawBlock(const Block& block, std::span<const Entry> active);
  void drawParts(const Block& block, std::span<const Entry> active);
  void layOut(const RayBundle& bundle, const LatticeWindow& shape);
  [[nodiscard]] bool addForm(const LatticeForm& form);
  [[nodiscard]] bool addRow(const LatticeForm& form, const LatticePlace& center, int slab, int row);
  void finishVoxels();
  void drawRay(const Block& block, int column, int row);

  Window window_{};
  std::vector<LatticeSlab> slabs_;
  std::vector<float> values_;  ///< sums, then voxels
  std::vector<char> filled_;   ///< slabs that something was added to
};

}  // namespace esvr
