// The bricks of a field on a CUDA device, which are decoded when a ray asks for them.

#include "render/cell_bricks.h"
#include "render/cuda/cell_store.h"

namespace esvr::cuda {
namespace {

class FieldStore final : public CellStore {
 public:
  FieldStore(const CellField& field, cudaStream_t stream)
      : places_(placesOf(field.table)),
        stream_(stream),
        cells_(field, stream),
        cache_(cells_, stream) {}

  float background() const override { return cells_.background(); }
  /// Makes all levels at once, because the bricks of all are numbered together.
  void prepare(const LevelBounds& bounds) override {
    if (bounds.last == 0 || cells_.levelCount() == kLevels) return;
    std::vector<Coord> bricks = std::move(places_);
    while (cells_.levelCount() < kLevels) {
      bricks = coarserBricks(bricks);
      cells_.add(
          DeviceLevel(makeBrickTable(bricksWithCells(bricks), cells_.brickCount()), stream_));
    }
    cache_.number();
  }
  const DeviceLevel& level(int level) const override { return cells_.level(level); }
  BrickSlotsView slots() const override { return cache_.slots(); }
  BrickCache* cache() override { return &cache_; }
  std::size_t bytes() const override { return cells_.bytes() + cache_.bytes(); }

 private:
  std::vector<Coord> places_;  ///< bricks of level 0, until the coarser levels are made
  cudaStream_t stream_;
  DeviceCells cells_;
  BrickCache cache_;
};

}  // namespace

std::unique_ptr<CellStore> storeOf(const Field& field, const RevoxeliseOptions& voxels,
                                   cudaStream_t stream) {
  return std::make_unique<FieldStore>(makeCellField(field, voxels), stream);
}

}  // namespace esvr::cuda
