#pragma once
/// The bricks of cells that a CUDA renderer marches through, with their levels of detail.

#include <memory>

#include "esvr/field.h"
#include "render/cuda/brick_cache.h"
#include "render/cuda/device_level.h"
#include "render/level_of_detail.h"

namespace esvr::cuda {

class CellStore {
 public:
  CellStore() = default;
  CellStore(const CellStore&) = delete;
  CellStore& operator=(const CellStore&) = delete;
  virtual ~CellStore() = default;

  [[nodiscard]] virtual float background() const = 0;
  /// A box around all cells of level 0, in index space.
  [[nodiscard]] PlaceBox box() const {
    const DeviceLevel& cells = level(0);
    const Vec3 from = pointOf(cells.table().origin);
    return {sum(cells.box().low, from), sum(cells.box().high, from)};
  }
  /// Makes the levels that a picture needs.
  virtual void prepare(const LevelBounds& bounds) = 0;
  /// A level that was prepared.
  [[nodiscard]] virtual const DeviceLevel& level(int level) const = 0;
  [[nodiscard]] virtual BrickSlotsView slots() const = 0;
  /// Decodes bricks when rays ask for them; null if all bricks are there.
  [[nodiscard]] virtual BrickCache* cache() { return nullptr; }
  [[nodiscard]] virtual std::size_t bytes() const = 0;
};

/// The voxels of a field, which are decoded when a ray asks for them.
/// \throws RuntimeFailure, UsageError  as for makeCellField
[[nodiscard]] std::unique_ptr<CellStore> storeOf(const Field& field,
                                                 const RevoxeliseOptions& voxels,
                                                 cudaStream_t stream);
/// The voxels of a volume, which must outlive the store.
[[nodiscard]] std::unique_ptr<CellStore> storeOf(const SparseVolume& volume, cudaStream_t stream);

}  // namespace esvr::cuda
