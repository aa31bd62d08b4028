#include "core/cuda/check.h"
#include "core/cuda/thread_number.cuh"
#include "render/cuda/slot_account.h"

#include "render/brick_march.h"
#include "render/oldest_slots.h"

namespace esvr::cuda {
namespace {

__global__ void setAll(std::uint32_t* slotOf, std::uint32_t bricks, std::uint32_t value) {
  const std::size_t brick = threadNumber();
  if (brick < bricks) slotOf[brick] = value;
}

__global__ void makeMissing(SlotAccount a, const std::uint32_t* bricks, std::uint32_t count) {
  const std::size_t n = threadNumber();
  if (n < count) a.slotOf[bricks[n]] = BrickSlotsView::kMissing;
}

/// Slots are taken from the end, so that the lowest is taken first.
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

__global__ void drop(SlotAccount a, const std::uint32_t* slots, std::uint32_t count,
                     std::uint32_t before) {
  const std::uint32_t n = std::uint32_t(threadNumber());
  if (n >= count) return;
  a.slotOf[a.owners[slots[n]]] = BrickSlotsView::kMissing;
  a.owners[slots[n]] = kNoOwner;
  a.free[before + n] = slots[n];
  if (n == 0) a.counts->free = before + count;
}

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

}  // namespace

void launchSetAll(std::uint32_t* slotOf, std::uint32_t bricks, std::uint32_t value,
                  cudaStream_t stream) {
  if (bricks == 0) return;
  setAll<<<blocksFor(bricks, kBlock), kBlock, 0, stream>>>(slotOf, bricks, value);
  check(cudaGetLastError(), "setting the slots of bricks");
}

void launchMakeMissing(const SlotAccount& a, const std::uint32_t* bricks, std::uint32_t count,
                       cudaStream_t stream) {
  if (count == 0) return;
  makeMissing<<<blocksFor(count, kBlock), kBlock, 0, stream>>>(a, bricks, count);
  check(cudaGetLastError(), "setting the slots of bricks");
}

void launchAddFree(const SlotAccount& a, std::uint32_t first, std::uint32_t count,
                   std::uint32_t before, cudaStream_t stream) {
  if (count == 0) return;
  addFree<<<blocksFor(count, kBlock), kBlock, 0, stream>>>(a, first, count, before);
  check(cudaGetLastError(), "adding slots");
}

void launchDrop(const SlotAccount& a, const std::uint32_t* slots, std::uint32_t count,
                std::uint32_t before, cudaStream_t stream) {
  if (count == 0) return;
  drop<<<blocksFor(count, kBlock), kBlock, 0, stream>>>(a, slots, count, before);
  check(cudaGetLastError(), "dropping bricks");
}

void launchSettle(const SlotAccount& a, const DecodedBricks& d, cudaStream_t stream) {
  if (d.count == 0) return;
  settle<<<blocksFor(d.count, kBlock), kBlock, 0, stream>>>(a, d);
  takeBack<<<1, kBlock, 0, stream>>>(a, d.freeBefore - d.count);
  check(cudaGetLastError(), "giving bricks their slots");
}

}  // namespace esvr::cuda
