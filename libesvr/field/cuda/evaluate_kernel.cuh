#pragma once
/// The kernel that evaluates a field on bricks: one block a brick. Its ellipsoids come through
/// shared memory, a stage at a time and in the pairs' order, so that sums have one order.

#include <cstdint>

#include "esvr/sparse_volume.h"
#include "field/cuda/evaluate_launch.h"
#include "field/cuda/evaluate_tuning.h"
#include "field/line_math.h"

namespace esvr::cuda {

/// Aligned so that the compiler loads 16 bytes at once.
struct alignas(16) StagedForm {
  LineForm form;
};

template <bool kOwnKernels>
struct EvaluateStage {
  StagedForm forms[EvaluateTuning::kStage];  ///< centers relative to the brick's corner
  KernelConstants<float> kernels[kOwnKernels ? EvaluateTuning::kStage : 1];
};

/// Voxels of a thread: `first`, and every kStride-th that follows in its slice. A warp's are
/// neighbours, so its stores coalesce.
struct ThreadVoxels {
  static constexpr int kThreadsPerSlice = EvaluateTuning::kThreads / kBrickSide;
  static constexpr int kStride = kThreadsPerSlice;
  static constexpr int kStepY = kStride / kBrickSide;

  __device__ explicit ThreadVoxels(int thread)
      : first(thread / kThreadsPerSlice * (kBrickSide * kBrickSide) + thread % kThreadsPerSlice),
        x(float(voxelLocal(first).x)),
        y(float(voxelLocal(first).y)),
        z(float(voxelLocal(first).z)) {}

  int first;      ///< offset in the brick
  float x, y, z;  ///< of `first`; the n-th lies at y + n kStepY
};

template <bool kOwnKernels>
__device__ void stageEllipsoid(const EvaluateArguments& a, Coord corner, std::uint32_t pair,
                               int slot, EvaluateStage<kOwnKernels>& stage) {
  const std::uint32_t i = a.ellipsoid[pair];
  const Coord local = corner - a.origins[a.chunkOf[i]];
  LineForm form = a.forms[i];
  form.center[0] -= float(local.x);
  form.center[1] -= float(local.y);
  form.center[2] -= float(local.z);
  stage.forms[slot].form = form;
  if constexpr (kOwnKernels) stage.kernels[slot] = a.ownKernels[i];
}

/// sum += intensity * phi at a thread's voxels.
__device__ inline void addEllipsoid(const LineForm& f, const KernelConstants<float>& k,
                                    const ThreadVoxels& voxels,
                                    float (&sum)[EvaluateTuning::kVoxelsPerThread]) {
  const float dx = voxels.x - f.center[0], dz = voxels.z - f.center[2];
  const float pzDz[3] = {f.pz[0] * dz, f.pz[1] * dz, f.pz[2] * dz};
  const float closest = closestSquared(f, dx, pzDz);
  if (!(closest < k.cutoff)) return;  // the line misses the support
  float t = distanceAlong(f, voxels.y, f.center[1], dx, dz);
  for (float& s : sum) {
    s += f.intensity * kernelPhi(k, squaredAt(f, closest, t));
    t += float(ThreadVoxels::kStepY);
  }
}

/// \tparam kOwnKernels  ellipsoids have each their own kernel
template <bool kOwnKernels>
__global__ void __launch_bounds__(EvaluateTuning::kThreads)
    evaluateBricksKernel(const EvaluateArguments a) {
  __shared__ EvaluateStage<kOwnKernels> stage;
  const ThreadVoxels voxels(int(threadIdx.x));
  const Coord corner = a.corners[blockIdx.x];
  float sum[EvaluateTuning::kVoxelsPerThread] = {};

  std::uint32_t pair = a.brickBegin[blockIdx.x] - a.firstPair;
  std::uint32_t left = a.brickBegin[blockIdx.x + 1] - a.firstPair - pair;
  while (left > 0) {
    const std::uint32_t count = min(left, std::uint32_t{EvaluateTuning::kStage});
    if (threadIdx.x < count) stageEllipsoid(a, corner, pair + threadIdx.x, int(threadIdx.x), stage);
    __syncthreads();
    for (std::uint32_t i = 0; i < count; ++i)
      addEllipsoid(stage.forms[i].form, kOwnKernels ? stage.kernels[i] : a.kernel, voxels, sum);
    __syncthreads();  // the next stage overwrites this one
    pair += count, left -= count;
  }
  float* const out = a.values + std::size_t(blockIdx.x) * kBrickVoxels + voxels.first;
  for (int n = 0; n < EvaluateTuning::kVoxelsPerThread; ++n)
    out[n * ThreadVoxels::kStride] = a.background + sum[n];
}

}  // namespace esvr::cuda
