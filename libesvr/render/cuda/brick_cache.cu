// Keeps account of which brick has which slot (BrickSlotsView): bricks that rays ask for are
// decoded into free slots, and slots that have not been read for long are taken from their bricks
// when memory is short.
#include <algorithm>

#include "core/cuda/device_buffer.h"
#include "core/cuda/reduce.cuh"
#include "core/cuda/runtime.h"
#include "render/cuda/cell_store.h"

namespace esvr::cuda {

/// The tables of a cache. All pointers are to device memory.
struct SlotAccount {
  std::uint32_t* slotOf;  ///< by brick
  std::uint32_t* owners;  ///< by slot: its brick, or kNoOwner
  std::uint32_t* stamps;  ///< by slot: time of the last reading
  std::uint32_t* free;    ///< slots without an owner; the first `counts->free`
  std::uint32_t* spare;   ///< memory for as many slots
  BrickDemand::Counts* counts;
  std::uint32_t now;
};

namespace {

/// Missing bricks that a ray asks for besides the one at which it waits. More need fewer passes,
/// but decode bricks that an opaque one may hide. A ray that has waited before is not stopped soon,
/// and asks for four times as many.
constexpr int kAhead = 16, kMostPasses = 4;

/// Bricks that have been decoded.
struct DecodedBricks {
  const std::uint32_t* bricks;
  std::uint32_t count;
  std::uint32_t freeBefore;      ///< brick n was decoded into slot free[freeBefore - 1 - n]
  const std::uint8_t* occupied;  ///< 0: all voxels are the background
};

__global__ void setAll(std::uint32_t* slotOf, std::uint32_t bricks, std::uint32_t value) {
  const std::size_t brick = threadNumber();
  if (brick < bricks) slotOf[brick] = value;
}
/// The listed bricks become missing.
__global__ void makeMissing(SlotAccount a, const std::uint32_t* bricks, std::uint32_t count) {
  const std::size_t n = threadNumber();
  if (n < count) a.slotOf[bricks[n]] = BrickSlotsView::kMissing;
}
/// Adds slots from `first` on to the free ones, of which there are `before`. Slots are taken from
/// the end, so that the lowest is taken first.
__global__ void addFree(SlotAccount a, std::uint32_t first, std::uint32_t count,
                        std::uint32_t before) {
  const std::uint32_t n = std::uint32_t(threadNumber());
  if (n >= count) return;
  const std::uint32_t slot = first + count - 1 - n;
  a.free[before + n] = slot;
  a.owners[slot] = kNoOwner;
  a.stamps[slot] = 0;
  if (n == 0) a.counts->free = before + count;
}

/// Takes slots away from their bricks.
__global__ void drop(SlotAccount a, const std::uint32_t* slots, std::uint32_t count,
                     std::uint32_t before) {
  const std::uint32_t n = std::uint32_t(threadNumber());
  if (n >= count) return;
  a.slotOf[a.owners[slots[n]]] = BrickSlotsView::kMissing;
  a.owners[slots[n]] = kNoOwner;
  a.free[before + n] = slots[n];
  if (n == 0) a.counts->free = before + count;
}

/// Gives decoded bricks their slots, and notes the slots of those that are vacant.
__global__ void settle(SlotAccount a, DecodedBricks d) {
  const std::uint32_t n = std::uint32_t(threadNumber());
  if (n >= d.count) return;
  const std::uint32_t slot = a.free[d.freeBefore - 1 - n], brick = d.bricks[n];
  if (d.occupied[n] != 0) {
    a.slotOf[brick] = slot;
    a.owners[slot] = brick;
    a.stamps[slot] = a.now;
  } else {
    a.slotOf[brick] = BrickSlotsView::kVacant;
    a.spare[atomicAdd(&a.counts->spare, 1u)] = slot;
  }
}
/// One block puts the slots that were not needed back.
__global__ void takeBack(SlotAccount a, std::uint32_t free) {
  const std::uint32_t spare = a.counts->spare;
  for (std::uint32_t n = threadIdx.x; n < spare; n += blockDim.x) a.free[free + n] = a.spare[n];
  __syncthreads();
  if (threadIdx.x != 0) return;
  a.counts->free = free + spare;
  a.counts->spare = 0;
}

/// Runs a kernel with a thread for each of `count` things.
template <class... Parameters, class... Arguments>
void runForEach(std::uint32_t count, cudaStream_t stream, const char* what,
                void (*kernel)(Parameters...), const Arguments&... arguments) {
  if (count == 0) return;
  kernel<<<blocksFor(count, kBlock), kBlock, 0, stream>>>(arguments...);
  check(cudaGetLastError(), what);
}

}  // namespace

std::vector<std::uint32_t> oldestSlots(std::size_t count, std::span<const std::uint32_t> owners,
                                       std::span<const std::uint32_t> stamps) {
  std::vector<std::uint32_t> owned;
  for (std::uint32_t slot = 0; slot < owners.size(); ++slot)
    if (owners[slot] != kNoOwner) owned.push_back(slot);
  count = std::min(count, owned.size());
  std::ranges::nth_element(owned, owned.begin() + std::ptrdiff_t(count), {},
                           [&](std::uint32_t slot) { return stamps[slot]; });
  owned.resize(count);
  return owned;
}

BrickCache::BrickCache(const DeviceCells& cells, cudaStream_t stream)
    : cells_(cells),
      stream_(stream),
      pageTable_(stream),
      owners_(stream),
      stamps_(stream),
      free_(stream),
      spare_(stream),
      occupied_(stream),
      counts_(1, stream) {
  number();
}

void BrickCache::number() {
  makeRoom(slotOf_, cells_.brickCount(), stream_);
  makeRoom(asked_, cells_.brickCount(), stream_);
  forget();
}

SlotAccount BrickCache::account() {
  return {slotOf_.data(),
          owners_.data(),
          stamps_.data(),
          free_.data(),
          spare_.data(),
          counts_.data(),
          now_};
}

void BrickCache::forget() {
  counts_.setZero();
  runForEach(cells_.brickCount(), stream_, "setting the slots of bricks", setAll, slotOf_.data(),
             cells_.brickCount(), BrickSlotsView::kMissing);
  runForEach(slotCount(), stream_, "adding slots", addFree, account(), 0u, slotCount(), 0u);
}

BrickDemand BrickCache::demand(int pass) {
  check(cudaMemsetAsync(counts_.data(), 0, 2 * sizeof(std::uint32_t), stream_), "clearing counts");
  return {.counts = counts_.data(),
          .slotOf = slotOf_.data(),
          .bricks = asked_.data(),
          .stamps = maxBytes_ == 0 ? nullptr : stamps_.data(),
          .now = ++now_,
          .ahead = crowded_ ? 0 : kAhead << 2 * std::min(pass, kMostPasses)};
}

BrickDemand::Counts BrickCache::counts() { return downloaded_.download(counts_.data(), stream_); }

void BrickCache::serve(const BrickDemand::Counts& counts, const LevelBounds& levels) {
  const std::uint32_t free = makeRoomFor(counts.bricks, counts.free);
  const std::uint32_t served = std::min(counts.bricks, free), left = counts.bricks - served;
  // A ray that asks for the brick at which it waits, and no other, makes progress with each brick.
  crowded_ = left > 0;
  runForEach(left, stream_, "setting the slots of bricks", makeMissing, account(),
             asked_.data() + served, left);
  decode(served, free, levels);
}

/// Adds pages, or drops bricks where there cannot be more pages. \return the number of free slots
std::uint32_t BrickCache::makeRoomFor(std::uint32_t bricks, std::uint32_t free) {
  while (free < bricks && addPage(free)) free += BrickSlotsView::kPageSlots;
  return free < bricks ? free + evict(bricks - free, free) : free;
}

/// \param free  number of free slots before
/// \return false if there is no memory for a further page
bool BrickCache::addPage(std::uint32_t free) {
  const bool may =
      pages_.empty() || maxBytes_ == 0 || (pages_.size() + 1) * kPageBytes <= maxBytes_;
  if (!may) return false;
  const std::size_t before = slotCount(), after = before + BrickSlotsView::kPageSlots;
  try {
    DeviceBuffer<float> page(BrickSlotsView::kPageFloats, stream_);
    float* const values = page.data();
    float** const table = pageTable_.extend(pages_.size() + 1, pages_.size());
    uploadTo(table + pages_.size(), std::span<float* const>(&values, 1), stream_);
    (void)owners_.extend(after, before);
    (void)stamps_.extend(after, before);
    (void)free_.extend(after, before);
    (void)spare_.reserve(after);
    pages_.push_back(std::move(page));
  } catch (const DeviceMemoryError&) {
    if (pages_.empty()) throw;
    maxBytes_ = pages_.size() * kPageBytes;
    return false;
  }
  runForEach(BrickSlotsView::kPageSlots, stream_, "adding slots", addFree, account(),
             std::uint32_t(before), BrickSlotsView::kPageSlots, free);
  return true;
}

/// Drops the bricks that were not read for the longest time. \return how many
std::uint32_t BrickCache::evict(std::uint32_t bricks, std::uint32_t free) {
  std::vector<std::uint32_t> owners(slotCount()), stamps(slotCount());
  downloadTo(std::span(owners), owners_.data(), stream_);
  downloadTo(std::span(stamps), stamps_.data(), stream_);
  const auto slots = oldestSlots(bricks, owners, stamps);
  const auto count = std::uint32_t(slots.size());
  uploadTo(spare_.data(), std::span<const std::uint32_t>(slots), stream_);
  runForEach(count, stream_, "dropping bricks", drop, account(), spare_.data(), count, free);
  return count;
}

void BrickCache::decode(std::uint32_t bricks, std::uint32_t free, const LevelBounds& levels) {
  if (bricks == 0) return;
  std::uint8_t* const occupied = occupied_.reserve(bricks);
  check(cudaMemsetAsync(occupied, 0, bricks, stream_), "clearing marks");
  for (int level = levels.first; level <= levels.last; ++level)
    launchDecode({.field = cells_.view(level),
                  .bricks = asked_.data(),
                  .count = bricks,
                  .lastSlot = free_.data() + free - 1,
                  .pages = pageTable_.data(),
                  .occupied = occupied},
                 level, stream_);
  runForEach(bricks, stream_, "giving bricks their slots", settle, account(),
             DecodedBricks{asked_.data(), bricks, free, occupied});
  takeBack<<<1, kBlock, 0, stream_>>>(account(), free - bricks);
  check(cudaGetLastError(), "taking slots back");
}

std::size_t BrickCache::bytes() const {
  return pages_.size() * BrickSlotsView::kPageFloats * sizeof(float) + pageTable_.bytes() +
         slotOf_.bytes() + asked_.bytes() + owners_.bytes() + stamps_.bytes() + free_.bytes() +
         spare_.bytes() + occupied_.bytes();
}

}  // namespace esvr::cuda
