#include <algorithm>
#include <cub/device/device_merge_sort.cuh>

#include "core/cuda/copy.h"
#include "core/cuda/count32.h"
#include "core/cuda/launch.h"
#include "core/cuda/temporary.h"
#include "fit/cuda/brick_table.h"
#include "fit/cuda/reached_bricks.cuh"

namespace esvr::cuda {
namespace {

constexpr std::size_t kMinReachedSlots = std::size_t{1} << 12;

/// Largest number of slots that are probed for a brick. A table that is at most half full never
/// needs so many: in one with 2^24 slots the longest probe has a length of about 90.
constexpr int kMaxProbes = 256;

__global__ void insertTargets(const Coord* bricks, std::uint32_t count, std::uint32_t* slots,
                              std::uint32_t mask) {
  const std::size_t number = threadNumber();
  if (number >= count) return;
  std::uint32_t s = std::uint32_t(hashOf(bricks[number])) & mask;
  while (atomicCAS(&slots[s], kNoBrick, std::uint32_t(number)) != kNoBrick) s = (s + 1) & mask;
}

/// The table into which kernels insert bricks. If the table is too small, `count` ends above
/// maxCount.
struct ReachedInsertion {
  ReachedSlot* slots;
  std::uint32_t mask;
  std::uint32_t maxCount;
  std::uint32_t* count;
  BrickTableView targets;  ///< target bricks, which are not inserted
  Box within;              ///< bricks outside are not inserted
};

/// Waits until a claimed slot holds its brick. \return true if that is the given brick
__device__ bool holds(ReachedSlot& slot, Coord brick) {
  volatile int* const state = &slot.state;
  while (*state != ReachedSlot::kReady) __nanosleep(20);
  __threadfence();
  const volatile Coord& there = slot.brick;
  return there.x == brick.x && there.y == brick.y && there.z == brick.z;
}

/// Claims an empty slot for a brick. \return false if another thread has claimed it before
__device__ bool claim(ReachedSlot& slot, Coord brick, std::uint32_t* count) {
  if (atomicCAS(&slot.state, ReachedSlot::kEmpty, ReachedSlot::kBeingWritten) !=
      ReachedSlot::kEmpty)
    return false;
  slot.brick = brick;
  __threadfence();
  atomicExch(&slot.state, ReachedSlot::kReady);
  atomicAdd(count, 1u);
  return true;
}

__device__ bool tooSmall(const ReachedInsertion& into) {
  return *static_cast<volatile std::uint32_t*>(into.count) > into.maxCount;
}

/// Claims a slot for a brick, unless the brick has one. Threads that begin at the same time can
/// fill the table before any of them sees the count, so the length of a probe is limited too.
__device__ void insertReached(const ReachedInsertion& into, Coord brick) {
  const auto hash = std::uint32_t(hashOf(brick));
  if (!into.within.contains(brick) || into.targets.findTarget(brick, hash) != kNoBrick) return;
  for (int probe = 0; probe < kMaxProbes; ++probe) {
    ReachedSlot& slot = into.slots[(hash + std::uint32_t(probe)) & into.mask];
    const bool empty = *static_cast<volatile int*>(&slot.state) == ReachedSlot::kEmpty;
    if (empty && tooSmall(into)) return;
    if ((empty && claim(slot, brick, into.count)) || holds(slot, brick)) return;
  }
  atomicMax(into.count, into.maxCount + 1);
}

__global__ void collectReached(SupportSource source, ReachedInsertion into) {
  walkReachedBricks(source, into.within, [&](const auto& bricks) {
    bricks.visit([&](Coord brick, bool reached) {
      if (reached) insertReached(into, brick);
    });
  });
}

constexpr int kNeighbours = 27;  // including the brick itself

__global__ void collectAround(const Coord* bricks, std::uint32_t count, ReachedInsertion into) {
  const std::size_t n = threadNumber();
  if (n >= std::size_t(count) * kNeighbours) return;
  const int side = int(n % kNeighbours);
  insertReached(into,
                bricks[n / kNeighbours] + Coord{side / 9 - 1, side / 3 % 3 - 1, side % 3 - 1});
}

/// Lists the reached bricks in any order. They are sorted afterwards.
__global__ void listReached(const ReachedSlot* slots, std::uint32_t slotCount, Coord* out,
                            std::uint32_t* count) {
  const std::size_t s = threadNumber();
  if (s < slotCount && slots[s].state == ReachedSlot::kReady)
    out[atomicAdd(count, 1u)] = slots[s].brick;
}

__global__ void numberReached(const Coord* sorted, std::uint32_t count, std::uint32_t first,
                              ReachedSlot* slots, std::uint32_t mask) {
  const std::size_t n = threadNumber();
  if (n >= count) return;
  std::uint32_t s = std::uint32_t(hashOf(sorted[n])) & mask;
  while (!sameBrick(slots[s].brick, sorted[n])) s = (s + 1) & mask;
  slots[s].number = first + std::uint32_t(n);
}

struct InOrder {
  __host__ __device__ bool operator()(const Coord& a, const Coord& b) const {
    if (a.x != b.x) return a.x < b.x;
    return a.y != b.y ? a.y < b.y : a.z < b.z;
  }
};

}  // namespace

BrickTable::BrickTable(std::span<const Coord> targetBricks, cudaStream_t stream)
    : stream_(stream),
      targetCount_(count32(targetBricks.size(), "bricks")),
      bricks_(stream),
      slots_(stream),
      reachedSlots_(stream),
      counter_(stream),
      temporary_(stream) {
  for (const Coord brick : targetBricks) targetBounds_.expand(brick);
  bounds_ = targetBounds_;
  uploadTo(bricks_.reserve(targetCount_), targetBricks, stream);
  buildTargetTable();
  counter_.reserve(1);
}

void BrickTable::buildTargetTable() {
  slotCount_ = slotsFor(targetCount_);
  std::uint32_t* const slots = slots_.reserve(slotCount_);
  check(cudaMemsetAsync(slots, 0xff, slotCount_ * sizeof(*slots), stream_), "clearing a table");
  if (targetCount_ == 0) return;
  insertTargets<<<blocksFor(targetCount_, kBlock), kBlock, 0, stream_>>>(
      bricks_.data(), std::uint32_t(targetCount_), slots, std::uint32_t(slotCount_ - 1));
  check(cudaGetLastError(), "filling the table of bricks");
}

/// \param launch  launch(insertion) starts the kernel that inserts the bricks
/// \return false if the table was too small
template <class Launch>
bool BrickTable::collect(const Box& within, Launch&& launch) {
  ReachedSlot* const slots = reachedSlots_.reserve(reachedSlotCount_);
  check(cudaMemsetAsync(slots, 0, reachedSlotCount_ * sizeof(*slots), stream_), "clearing a table");
  check(cudaMemsetAsync(counter_.data(), 0, sizeof(std::uint32_t), stream_), "clearing a counter");
  const auto maxCount = std::uint32_t(reachedSlotCount_ / 2);
  launch(ReachedInsertion{slots, std::uint32_t(reachedSlotCount_ - 1), maxCount, counter_.data(),
                          view(), within});
  check(cudaGetLastError(), "finding reached bricks");
  reachedCount_ = downloadValue(counter_.data(), stream_);
  return reachedCount_ <= maxCount;
}

void BrickTable::number() {
  if (reachedCount_ == 0) return;
  Coord* const reached = bricks_.extend(size(), targetCount_) + targetCount_;
  const auto slotCount = std::uint32_t(reachedSlotCount_);
  check(cudaMemsetAsync(counter_.data(), 0, sizeof(std::uint32_t), stream_), "clearing a counter");
  listReached<<<blocksFor(slotCount, kBlock), kBlock, 0, stream_>>>(reachedSlots_.data(), slotCount,
                                                                    reached, counter_.data());
  check(cudaGetLastError(), "listing reached bricks");
  withTemporary(temporary_, "sorting reached bricks", [&](void* memory, std::size_t& bytes) {
    return cub::DeviceMergeSort::SortKeys(memory, bytes, reached, reachedCount_, InOrder{},
                                          stream_);
  });
  numberReached<<<blocksFor(reachedCount_, kBlock), kBlock, 0, stream_>>>(
      reached, std::uint32_t(reachedCount_), std::uint32_t(targetCount_), reachedSlots_.data(),
      slotCount - 1);
  check(cudaGetLastError(), "numbering reached bricks");
}

void BrickTable::forgetReached() {
  reachedCount_ = 0;
  bounds_ = targetBounds_;
}

/// \param expected  expected number of reached bricks; the table grows if there are more
template <class Launch>
void BrickTable::find(std::size_t expected, const Box& within, Launch&& launch) {
  reachedSlotCount_ = std::max({reachedSlotCount_, kMinReachedSlots, slotsFor(expected)});
  while (!collect(within, launch))
    reachedSlotCount_ = count32(4 * reachedSlotCount_, "slots of a table of bricks");
  (void)count32(size(), "bricks");
  if (reachedCount_ > 0) bounds_.expand(within);
  number();
}

void BrickTable::findReached(const SupportSource& supports, const Box& within) {
  forgetReached();
  if (supports.count == 0) return;
  find(targetCount_, within, [&](const ReachedInsertion& into) {
    collectReached<<<blocksFor(supports.count * kWarp, kBlock), kBlock, 0, stream_>>>(supports,
                                                                                      into);
  });
}

void BrickTable::findAround(const BrickTable& other, const Box& within) {
  forgetReached();
  if (other.size() == 0) return;
  find(2 * other.size(), within, [&](const ReachedInsertion& into) {
    collectAround<<<blocksFor(other.size() * kNeighbours, kBlock), kBlock, 0, stream_>>>(
        other.bricks_.data(), std::uint32_t(other.size()), into);
  });
}

BrickTableView BrickTable::view() const {
  return {bricks_.data(),
          slots_.data(),
          std::uint32_t(slotCount_ - 1),
          reachedSlots_.data(),
          std::uint32_t(reachedSlotCount_ - 1),
          reachedCount_ > 0,
          bounds_};
}

}  // namespace esvr::cuda
