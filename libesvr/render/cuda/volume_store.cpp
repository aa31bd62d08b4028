// The bricks of a volume on a CUDA device. Each level is made when a picture first needs it.

#include <array>
#include <optional>

#include "core/cuda/copy.h"
#include "render/brick_atlas.h"
#include "render/cuda/cell_store.h"
#include "render/voxel_levels.h"

namespace esvr::cuda {
namespace {

/// A number of slots that fills whole pages.
std::uint32_t wholePages(std::size_t slots) {
  constexpr std::size_t kSlots = BrickSlotsView::kPageSlots;
  return std::uint32_t((slots + kSlots - 1) / kSlots * kSlots);
}

class VolumeStore final : public CellStore {
 public:
  VolumeStore(const SparseVolume& volume, cudaStream_t stream)
      : stream_(stream), background_(volume.background), levels_(volume) {
    makeLevel(0);
  }

  float background() const override { return background_; }
  void prepare(const LevelBounds& bounds) override {
    levels_.prepare(bounds.last);
    for (int level = bounds.first; level <= bounds.last; ++level)
      if (!made_[std::size_t(level)]) makeLevel(level);
  }
  const DeviceLevel& level(int level) const override { return made_[std::size_t(level)]->level; }
  BrickSlotsView slots() const override { return {nullptr, pageTable_.data()}; }
  std::size_t bytes() const override {
    std::size_t bytes = pageTable_.bytes();
    for (const auto& made : made_)
      if (made) bytes += made->level.bytes() + made->values.bytes();
    return bytes;
  }

 private:
  struct Made {
    DeviceLevel level;
    DeviceBuffer<float> values;  ///< of all bricks; brick n has slot n
  };

  void makeLevel(int level) {
    const BrickAtlas atlas =
        makeBrickAtlas(levels_[level], std::uint32_t(pages_.size() * BrickSlotsView::kPageSlots));
    DeviceBuffer<float> values(
        std::size_t(wholePages(atlas.table.bricks.size())) * kCellBrickVoxels, stream_);
    uploadTo(values.data(), std::span<const float>(atlas.values), stream_);
    for (std::size_t first = 0; first < values.size(); first += BrickSlotsView::kPageFloats)
      pages_.push_back(values.data() + first);
    pageTable_ = DeviceBuffer<const float*>(pages_, stream_);
    made_[std::size_t(level)].emplace(DeviceLevel(atlas.table, stream_), std::move(values));
  }

  cudaStream_t stream_;
  float background_;
  VolumeLevels levels_;
  std::array<std::optional<Made>, kLevels> made_;
  std::vector<const float*> pages_;
  DeviceBuffer<const float*> pageTable_;  ///< see BrickSlotsView
};

}  // namespace

std::unique_ptr<CellStore> storeOf(const SparseVolume& volume, cudaStream_t stream) {
  return std::make_unique<VolumeStore>(volume, stream);
}

}  // namespace esvr::cuda
