#include "fit/cuda/moment_sums.h"

#include "core/cuda/launch.h"
#include "core/cuda/thread_number.cuh"
#include "fit/cuda/halt.h"

namespace esvr::cuda {
namespace {

constexpr int kLanes = 16;  // lanes of a chunk: kMoments, rounded up to a power of two
static_assert(kLanes >= kMoments);

/// Each lane sums one moment over the pairs of a chunk, which lie next to each other in memory.
__global__ void sumChunks(const MomentSums a) {
  const std::size_t thread = threadNumber();
  const std::size_t chunk = thread / kLanes, lane = thread % kLanes;
  if (chunk >= a.chunkCount || lane >= kMoments || isHalted(a.halted)) return;
  const std::uint32_t i = a.lists.chunkOwner[chunk];
  const std::uint32_t begin = a.lists.ellipsoidBegin[i] +
                              std::uint32_t(chunk - a.lists.chunkBegin[i]) * PairListsView::kChunk;
  const std::uint32_t end = min(a.lists.ellipsoidBegin[i + 1], begin + PairListsView::kChunk);
  double sum = 0.0;
#pragma unroll 4
  for (std::uint32_t k = begin; k < end; ++k)
    sum += double(a.moments[std::size_t(k) * kMoments + lane]);
  a.chunkSums[chunk * kMoments + lane] = sum;
}

}  // namespace

void launchMomentSums(const MomentSums& sums, cudaStream_t stream) {
  if (sums.chunkCount == 0) return;
  sumChunks<<<blocksFor(std::size_t(sums.chunkCount) * kLanes, kBlock), kBlock, 0, stream>>>(sums);
  check(cudaGetLastError(), "starting the sums of moments");
}

}  // namespace esvr::cuda
