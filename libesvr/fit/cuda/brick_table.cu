#include <algorithm>
#include <bit>
#include <cub/device/device_merge_sort.cuh>

#include "fit/cuda/brick_table.h"
#include "fit/cuda/copy.h"
#include "fit/cuda/launch.h"
#include "fit/cuda/reached_bricks.cuh"
#include "fit/cuda/temporary.h"

namespace esvr::cuda {
namespace {

constexpr std::size_t kFewestReachedSlots = std::size_t{1} << 12;

/// Slots for so many entries: at most half full, so that probes stay short.
std::size_t slotsFor(std::size_t entries) { return std::bit_ceil(2 * entries + 2); }

__global__ void insertTargets(const Coord* bricks, std::uint32_t count, std::uint32_t* slots,
                              std::uint32_t mask) {
  const std::uint32_t number = blockIdx.x * blockDim.x + threadIdx.x;
  if (number >= count) return;
  std::uint32_t s = std::uint32_t(hashOf(bricks[number])) & mask;
  while (atomicCAS(&slots[s], kNoBrick, number) != kNoBrick) s = (s + 1) & mask;
}

/// Where, which and how many: the counter goes beyond `most` when the table is too small.
struct ReachedInsertion {
  ReachedSlot* slots;
  std::uint32_t mask;
  std::uint32_t maxCount;
  std::uint32_t* count;
  BrickTableView targets;  ///< these bricks and
  Box within;              ///< those beyond are passed over
};

/// Claims a slot for a brick, or finds the one it has.
__device__ void insertReached(const ReachedInsertion& into, Coord brick) {
  if (!into.within.contains(brick)) return;
  if (into.targets.findTarget(brick, std::uint32_t(hashOf(brick))) != kNoBrick) return;
  for (std::uint32_t s = std::uint32_t(hashOf(brick)) & into.mask;; s = (s + 1) & into.mask) {
    ReachedSlot& slot = into.slots[s];
    volatile int* const state = &slot.state;
    if (*state == ReachedSlot::kEmpty) {
      if (*static_cast<volatile std::uint32_t*>(into.count) > into.maxCount) return;
      if (atomicCAS(&slot.state, ReachedSlot::kEmpty, ReachedSlot::kBeingWritten) ==
          ReachedSlot::kEmpty) {
        slot.brick = brick;
        __threadfence();
        atomicExch(&slot.state, ReachedSlot::kReady);
        atomicAdd(into.count, 1u);
        return;
      }
    }
    while (*state != ReachedSlot::kReady) __nanosleep(20);
    __threadfence();
    const volatile Coord& there = slot.brick;
    if (there.x == brick.x && there.y == brick.y && there.z == brick.z) return;
  }
}

__global__ void collectReached(SupportSource source, ReachedInsertion into) {
  const std::size_t i = warpNumber();
  if (i >= source.count) return;
  visitReachedBricks(supportOf(source, i), [&](Coord brick, bool reached) {
    if (reached) insertReached(into, brick);
  });
}

constexpr int kNeighbours = 27;  // a brick itself is one

__global__ void collectAround(const Coord* bricks, std::uint32_t count, ReachedInsertion into) {
  const std::size_t n = std::size_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (n >= std::size_t(count) * kNeighbours) return;
  const int side = int(n % kNeighbours);
  insertReached(into,
                bricks[n / kNeighbours] + Coord{side / 9 - 1, side / 3 % 3 - 1, side % 3 - 1});
}

/// In any order; they are sorted next.
__global__ void listReached(const ReachedSlot* slots, std::uint32_t slotCount, Coord* out,
                            std::uint32_t* count) {
  const std::uint32_t s = blockIdx.x * blockDim.x + threadIdx.x;
  if (s < slotCount && slots[s].state == ReachedSlot::kReady)
    out[atomicAdd(count, 1u)] = slots[s].brick;
}

__global__ void numberReached(const Coord* sorted, std::uint32_t count, std::uint32_t first,
                              ReachedSlot* slots, std::uint32_t mask) {
  const std::uint32_t n = blockIdx.x * blockDim.x + threadIdx.x;
  if (n >= count) return;
  std::uint32_t s = std::uint32_t(hashOf(sorted[n])) & mask;
  while (!sameBrick(slots[s].brick, sorted[n])) s = (s + 1) & mask;
  slots[s].number = first + n;
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
      targetCount_(targetBricks.size()),
      bricks_(stream),
      slots_(stream),
      reachedSlots_(stream),
      counter_(stream),
      temporary_(stream) {
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

/// \param launch  launch(where to) starts the kernel that inserts
template <class Launch>
bool BrickTable::collect(Launch&& launch) {
  ReachedSlot* const slots = reachedSlots_.reserve(reachedSlotCount_);
  check(cudaMemsetAsync(slots, 0, reachedSlotCount_ * sizeof(*slots), stream_), "clearing a table");
  check(cudaMemsetAsync(counter_.data(), 0, sizeof(std::uint32_t), stream_), "clearing a counter");
  const auto maxCount = std::uint32_t(reachedSlotCount_ / 2);
  launch(ReachedInsertion{slots, std::uint32_t(reachedSlotCount_ - 1), maxCount, counter_.data(),
                          view(), kAllBricks});
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

template <class Launch>
void BrickTable::find(Launch&& launch) {
  reachedSlotCount_ = std::max(reachedSlotCount_, kFewestReachedSlots);
  while (!collect(launch)) reachedSlotCount_ *= 4;
  number();
}

void BrickTable::findReached(const SupportSource& supports, const Box& within) {
  reachedCount_ = 0;
  if (supports.count == 0) return;
  find([&](ReachedInsertion into) {
    into.within = within;
    collectReached<<<blocksFor(supports.count * kWarp, kBlock), kBlock, 0, stream_>>>(supports,
                                                                                      into);
  });
}

void BrickTable::findAround(const BrickTable& other, const Box& within) {
  reachedCount_ = 0;
  if (other.size() == 0) return;
  find([&](ReachedInsertion into) {
    into.within = within;
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
          reachedCount_ > 0};
}

}  // namespace esvr::cuda
