#include "core/cuda/check.h"
#include "fit/cuda/halt.h"
#include "fit/cuda/offset_target.h"

namespace esvr::cuda {
namespace {

constexpr int kThreads = 128;  // threads of a block, which writes one brick

/// The bricks that the interpolation in one brick reads.
struct BricksToRead {
  const float* values[kInterpolatedBricks];  ///< null: not one of the target's
  bool nearest;

  [[nodiscard]] __device__ float at(const OffsetPlace& x, const OffsetPlace& y,
                                    const OffsetPlace& z) const {
    const float* const brick = values[4 * int(x.next) + 2 * int(y.next) + int(z.next)];
    if (brick != nullptr) return brick[(x.local * kBrickSide + y.local) * kBrickSide + z.local];
    if (!nearest || values[0] == nullptr) return 0.0f;
    return values[0][(x.nearest * kBrickSide + y.nearest) * kBrickSide + z.nearest];
  }
};

__device__ float mix(float a, float b, float weight) { return a + weight * (b - a); }

__device__ float interpolate(const BricksToRead& bricks, const OffsetAxis* axes, Coord voxel) {
  const OffsetPlace x[] = {offsetPlace(axes[0], voxel.x), offsetPlace(axes[0], voxel.x + 1)};
  const OffsetPlace y[] = {offsetPlace(axes[1], voxel.y), offsetPlace(axes[1], voxel.y + 1)};
  const OffsetPlace z[] = {offsetPlace(axes[2], voxel.z), offsetPlace(axes[2], voxel.z + 1)};
  const auto alongX = [&](int j, int k) {
    return mix(bricks.at(x[0], y[j], z[k]), bricks.at(x[1], y[j], z[k]), axes[0].weight);
  };
  const auto alongY = [&](int k) { return mix(alongX(0, k), alongX(1, k), axes[1].weight); };
  return mix(alongY(0), alongY(1), axes[2].weight);
}

/// Each block writes one brick.
__global__ void __launch_bounds__(kThreads) interpolateTarget(const OffsetTargetArguments a) {
  if (isHalted(a.halted)) return;
  __shared__ BricksToRead bricks;
  const OffsetAxis axes[] = {offsetAxis(a.offset[0]), offsetAxis(a.offset[1]),
                             offsetAxis(a.offset[2])};
  if (threadIdx.x < kInterpolatedBricks) {
    const Coord brick = interpolatedBrick(a.bricks.bricks[blockIdx.x], axes, int(threadIdx.x));
    const std::uint32_t number = a.bricks.findTarget(brick, std::uint32_t(hashOf(brick)));
    const bool found = number != kNoBrick;
    bricks.values[threadIdx.x] = found ? a.values + std::size_t(number) * kBrickVoxels : nullptr;
    bricks.nearest = a.nearest;
  }
  __syncthreads();
  float* const out = a.out + std::size_t(blockIdx.x) * kBrickVoxels;
  for (int v = int(threadIdx.x); v < kBrickVoxels; v += kThreads)
    out[v] = interpolate(bricks, axes, voxelLocal(v));
}

}  // namespace

void launchOffsetTarget(const OffsetTargetArguments& a, cudaStream_t stream) {
  if (a.brickCount == 0) return;
  interpolateTarget<<<a.brickCount, kThreads, 0, stream>>>(a);
  check(cudaGetLastError(), "starting to interpolate the target");
}

}  // namespace esvr::cuda
