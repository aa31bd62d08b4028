#include "render/cuda/decode_bricks.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "core/brick_index.h"
#include "core/cuda/copy.h"
#include "core/cuda/use_device.h"
#include "render/cell_field.h"
#include "render/cuda/brick_cache.h"
#include "render/cuda/decode_cells.h"

namespace esvr::cuda {
namespace {

constexpr std::uint32_t kBatch = BrickSlotsView::kPageSlots;  ///< bricks that are decoded at a time

/// Copies the voxels of a brick without those of its upper neighbours.
void copyVoxels(const float* cells, float* out) {
  for (int x = 0; x < kBrickSide; ++x)
    for (int y = 0; y < kBrickSide; ++y)
      std::copy_n(cells + (x * kCellBrickSide + y) * kCellBrickSide, kBrickSide,
                  out + voxelOffset({x, y, 0}));
}

/// A page of voxels on the device, into which batches of bricks are decoded.
class DecodeBatches {
 public:
  DecodeBatches(const DeviceCells& cells, cudaStream_t stream)
      : cells_(cells),
        stream_(stream),
        page_(BrickSlotsView::kPageFloats, stream),
        pageTable_(1, stream),
        numbers_(kBatch, stream),
        slots_(kBatch, stream),
        occupied_(kBatch, stream),
        values_(BrickSlotsView::kPageFloats) {
    float* const page = page_.data();
    uploadTo(pageTable_.data(), std::span<float* const>(&page, 1), stream);
    // Brick n of a batch gets slot n; the decoder counts down from the last slot.
    std::vector<std::uint32_t> slots(kBatch);
    std::iota(slots.rbegin(), slots.rend(), 0u);
    slots_.upload(slots);
  }

  /// Decodes bricks of the finest level. \return kCellBrickVoxels values for each brick
  const float* decode(std::span<const std::uint32_t> numbers) {
    uploadTo(numbers_.data(), numbers, stream_);
    occupied_.setZero();
    launchDecode({.field = cells_.view(),
                  .bricks = numbers_.data(),
                  .count = std::uint32_t(numbers.size()),
                  .lastSlot = slots_.data() + kBatch - 1,
                  .pages = pageTable_.data(),
                  .occupied = occupied_.data()},
                 0, stream_);
    page_.download(values_);
    return values_.data();
  }

 private:
  const DeviceCells& cells_;
  cudaStream_t stream_;
  DeviceBuffer<float> page_;
  DeviceBuffer<float*> pageTable_;
  DeviceBuffer<std::uint32_t> numbers_, slots_;
  DeviceBuffer<std::uint8_t> occupied_;
  std::vector<float> values_;
};

/// The bricks that ellipsoids reach: their numbers in the table and their places in the list.
struct Reached {
  std::vector<std::uint32_t> numbers;
  std::vector<std::size_t> places;
};
Reached reachedOf(const CellField& cells, std::span<const Coord> corners) {
  const BrickIndex table(placesOf(cells.table));
  Reached reached;
  for (std::size_t b = 0; b < corners.size(); ++b) {
    const std::uint32_t number = table.find(brickOf(corners[b]));
    if (number == BrickIndex::kNone) continue;
    reached.numbers.push_back(number);
    reached.places.push_back(b);
  }
  return reached;
}

}  // namespace

void decodeBricks(const Device& device, const Field& field, std::span<const Coord> corners,
                  std::span<float> out) {
  std::ranges::fill(out, field.background);
  const CellField cells = makeCellField(field, {.bricks = corners, .restrictToBricks = true});
  const Reached reached = reachedOf(cells, corners);
  if (reached.numbers.empty()) return;
  const Stream stream = streamOn(device);
  const DeviceCells onDevice(cells, stream.get());
  DecodeBatches batches(onDevice, stream.get());
  for (std::size_t first = 0; first < reached.numbers.size(); first += kBatch) {
    const std::size_t count = std::min<std::size_t>(kBatch, reached.numbers.size() - first);
    const float* const values = batches.decode(std::span(reached.numbers).subspan(first, count));
    for (std::size_t n = 0; n < count; ++n)
      copyVoxels(values + n * kCellBrickVoxels,
                 &out[reached.places[first + n] * std::size_t(kBrickVoxels)]);
  }
}

}  // namespace esvr::cuda
