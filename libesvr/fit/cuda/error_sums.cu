#include <array>
#include <cub/device/device_reduce.cuh>

#include "core/cuda/copy.h"
#include "core/cuda/reduce.cuh"
#include "core/cuda/temporary.h"
#include "core/cuda/thread_number.cuh"
#include "fit/cuda/error_sums.h"

namespace esvr::cuda {
namespace {

constexpr int kColumns = 4;  // members of FitErrors, in its order

/// Each warp sums one brick. Column c of brick b is written to out[c * brickCount + b].
__global__ void brickErrors(const ErrorArguments a, double* out) {
  const std::size_t b = warpNumber();
  if (b >= a.brickCount) return;
  const Coord corner = a.bricks[b] * kBrickSide;
  double all = 0.0, box = 0.0, active = 0.0, largest = 0.0;
  for (int v = int(threadIdx.x % kWarp); v < kBrickVoxels; v += kWarp) {
    const double r = double(a.residual[b * kBrickVoxels + v]);
    all += r * r;
    if (a.box.contains(corner + voxelLocal(v))) box += r * r;
    if (b < a.targetCount && a.active[b].test(v)) active += r * r;
    largest = fmax(largest, fabs(r));
  }
  all = warpSum(all), box = warpSum(box), active = warpSum(active), largest = warpMax(largest);
  if (threadIdx.x % kWarp != 0) return;
  const std::size_t n = a.brickCount;
  out[b] = all, out[n + b] = box, out[2 * n + b] = active, out[3 * n + b] = largest;
}

}  // namespace

ErrorSums::ErrorSums(cudaStream_t stream)
    : stream_(stream), columns_(stream), totals_(stream), temporary_(stream) {}

FitErrors ErrorSums::sum(const ErrorArguments& a) {
  const std::size_t n = a.brickCount;
  double* const columns = columns_.reserve(kColumns * n);
  double* const totals = totals_.reserve(kColumns);
  brickErrors<<<blocksFor(n * kWarp, kBlock), kBlock, 0, stream_>>>(a, columns);
  check(cudaGetLastError(), "summing errors");
  // On one kind of device, CUB reduces doubles in the same order in every run.
  for (int c = 0; c < kColumns; ++c)
    withTemporary(temporary_, "summing errors", [&](void* memory, std::size_t& bytes) {
      if (c == kColumns - 1)
        return cub::DeviceReduce::Max(memory, bytes, columns + c * n, totals + c, n, stream_);
      return cub::DeviceReduce::Sum(memory, bytes, columns + c * n, totals + c, n, stream_);
    });
  std::array<double, kColumns> values{};
  downloadTo(std::span<double>(values), totals, stream_);
  return {values[0], values[1], values[2], values[3]};
}

}  // namespace esvr::cuda
