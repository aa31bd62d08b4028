#include "core/cuda/check.h"
#include "fit/cuda/brick_pass.h"
#include "fit/cuda/launch.h"
#include "fit/cuda/pair_lines.cuh"
#include "fit/cuda/threads_per_brick.h"

namespace esvr::cuda {
namespace {

constexpr unsigned kAllLanes = 0xffffffffu;
constexpr int kMomentSlots = 16;  // kMoments, made a power of two
static_assert(kMomentSlots % kGroup == 0, "each lane ends with some of the moments");

enum class Pass { kGradients, kResiduals, kGivenGradients };

/// Of all threads, on every thread.
template <int kThreads>
__device__ float blockMax(float value) {
  __shared__ float parts[kThreads / kWarp];
  for (int d = kWarp / 2; d > 0; d /= 2) value = fmaxf(value, __shfl_xor_sync(kAllLanes, value, d));
  if (threadIdx.x % kWarp == 0) parts[threadIdx.x / kWarp] = value;
  __syncthreads();
  for (const float part : parts) value = fmaxf(value, part);
  __syncthreads();
  return value;
}

struct BrickEntries {
  std::uint32_t begin, end;
};

/// Values are summed as integers, whose sum has no order, in units of 2^-exponent: as fine as 31
/// bits allow where all of the brick's ellipsoids have their maximum at one voxel.
template <int kThreads>
__device__ int sumExponent(const BrickPassArguments& a, BrickEntries entries) {
  constexpr int kBits = 29, kFarthest = 100;
  float largest = 0.0f;
  for (std::uint32_t k = entries.begin + threadIdx.x; k < entries.end; k += kThreads)
    largest = fmaxf(largest, fabsf(a.forms[a.lists.ellipsoid[k]].form.intensity));
  const float bound = blockMax<kThreads>(largest) * float(entries.end - entries.begin);
  return bound > 0.0f ? max(-kFarthest, min(kBits - ilogbf(bound), kFarthest)) : 0;
}

/// kOwnKernels: ellipsoids differ in their edge.
template <bool kOwnKernels>
__device__ const KernelConstants<float>& kernelOf(const BrickPassArguments& a,
                                                  std::uint32_t entry) {
  if constexpr (kOwnKernels) return a.kernels[a.lists.ellipsoid[entry]];
  return a.kernel;
}

template <bool kOwnKernels>
__device__ void addPair(const BrickPassArguments& a, std::uint32_t entry, Coord corner, float unit,
                        int* sums) {
  const PairForm p = a.forms[a.lists.ellipsoid[entry]];
  const KernelConstants<float>& kernel = kernelOf<kOwnKernels>(a, entry);
  const float height = p.form.intensity * unit;
  visitLines(p, corner, kernel.cutoff, int(threadIdx.x % kGroup), [&](const PairLine& line) {
    float t = line.t;
    for (int y = line.yBegin; y < line.yEnd; ++y, t += 1.0f) {
      const float phi = fastPhi(kernel, squaredAt(p.form, line.closest, t));
      atomicAdd(&sums[line.offset + y * kBrickSide], __float2int_rn(height * phi));
    }
  });
}

/// r = V - target of voxel v, from the integer sum.
__device__ float residualOf(const BrickPassArguments& a, std::uint32_t brick, int v, float sum) {
  if (brick >= a.targetCount) return sum;
  const float t = a.target[std::size_t(brick) * kBrickVoxels + v];
  const float r = sum - t;
  return a.narrowBand ? fminf(fmaxf(r, a.lowest - t), a.highest - t) : r;
}

/// Sum over a warp, on its first lane.
__device__ double warpSum(double value) {
  for (int d = kWarp / 2; d > 0; d /= 2) value += __shfl_down_sync(kAllLanes, value, d);
  return value;
}

/// Leaves r in the shared memory that held the sums, and sum r^2 in the brick's loss: voxels are
/// summed in the same order whatever the number of threads.
template <int kThreads>
__device__ void toResiduals(const BrickPassArguments& a, std::uint32_t brick, int exponent,
                            int* sums) {
  __shared__ double parts[kBrickVoxels / kWarp];
  const float unit = ldexpf(1.0f, -exponent);
  for (int v = int(threadIdx.x); v < kBrickVoxels; v += kThreads) {
    const int at = paddedOffset(v);
    const float r = residualOf(a, brick, v, float(sums[at]) * unit);
    sums[at] = __float_as_int(r);
    if (a.residual != nullptr) a.residual[std::size_t(brick) * kBrickVoxels + v] = r;
    const double squares = warpSum(double(r) * double(r));
    if (v % kWarp == 0) parts[v / kWarp] = squares;
  }
  __syncthreads();
  if (threadIdx.x != 0) return;
  double loss = 0.0;
  for (const double part : parts) loss += part;
  a.brickLoss[brick] = loss;
}

/// Puts the given derivatives where residuals would be.
template <int kThreads>
__device__ void loadGiven(const BrickPassArguments& a, std::uint32_t brick, int* sums) {
  for (int v = int(threadIdx.x); v < kBrickVoxels; v += kThreads)
    sums[paddedOffset(v)] =
        __float_as_int(a.lossByValue[std::size_t(brick) * kBrickVoxels + std::size_t(v)]);
}

/// A lane's moments of a pair, in the order of PairMoments.
__device__ void sumMoments(const PairForm& p, const KernelConstants<float>& kernel, Coord corner,
                           const int* r, float (&s)[kMomentSlots]) {
  const float slopeBase = kernel.slope * kernel.base - 1.0f;
  visitLines(p, corner, kernel.cutoff, int(threadIdx.x % kGroup), [&](const PairLine& line) {
    float w0 = 0.0f, w1 = 0.0f, t = line.t;
    for (int y = line.yBegin; y < line.yEnd; ++y, t += 1.0f) {
      const float phi = fastPhi(kernel, squaredAt(p.form, line.closest, t));
      const float g = __int_as_float(r[line.offset + y * kBrickSide]);
      const float gq = phi > 0.0f ? g * (phi + kernel.base) : 0.0f;
      const float w = gq * (phi * kernel.slope + slopeBase);  // r phi'
      const float wt = w * t;
      w0 += w;
      w1 += wt;
      s[8] += wt * t;
      s[9] += g * phi;
      s[10] += phi * phi;
      s[11] += gq - gq * phi;
    }
    const float w0x = w0 * line.dx, w0z = w0 * line.dz;
    s[0] += w0x;
    s[1] += w0z;
    s[2] += w0x * line.dx;
    s[3] += w0x * line.dz;
    s[4] += w0z * line.dz;
    s[5] += w1;
    s[6] += w1 * line.dx;
    s[7] += w1 * line.dz;
  });
}

/// Sums of kGroup values over a group's lanes; lane n gets value n. Each exchange halves what a
/// lane keeps.
__device__ float transposeSum(float* s) {
  constexpr unsigned kLanes = kGroup == kWarp ? kAllLanes : (1u << kGroup) - 1u;
  const unsigned group = kLanes << (threadIdx.x % kWarp / kGroup * kGroup);
  const unsigned lane = threadIdx.x % kGroup;
#pragma unroll
  for (int w = kGroup / 2; w > 0; w /= 2) {
    const bool upper = (lane & unsigned(w)) != 0;
#pragma unroll
    for (int k = 0; k < w; ++k) {
      const float sent = upper ? s[k] : s[k + w];
      const float kept = upper ? s[k + w] : s[k];
      s[k] = kept + __shfl_xor_sync(group, sent, w);
    }
  }
  return s[0];
}

template <bool kOwnKernels>
__device__ void writeMoments(const BrickPassArguments& a, std::uint32_t entry, Coord corner,
                             const int* r) {
  const PairForm p = a.forms[a.lists.ellipsoid[entry]];
  float s[kMomentSlots] = {};
  sumMoments(p, kernelOf<kOwnKernels>(a, entry), corner, r, s);
  float* const out = a.moments + std::size_t(a.lists.pair[entry]) * kMoments;
#pragma unroll
  for (int first = 0; first < kMomentSlots; first += kGroup) {
    const float value = transposeSum(s + first);
    const int moment = first + int(threadIdx.x % kGroup);
    if (moment < kMoments) out[moment] = value;
  }
}

/// Leaves r of a brick in `sums`, and its loss in the arguments' array.
template <int kThreads, bool kOwnKernels>
__device__ void sumBrick(const BrickPassArguments& a, std::uint32_t brick, Coord corner,
                         BrickEntries entries, int* sums) {
  for (int v = int(threadIdx.x); v < kPaddedVoxels; v += kThreads) sums[v] = 0;
  const int exponent = sumExponent<kThreads>(a, entries);  // its barriers come after the zeros
  for (std::uint32_t k = entries.begin + threadIdx.x / kGroup; k < entries.end;
       k += kThreads / kGroup)
    addPair<kOwnKernels>(a, k, corner, ldexpf(1.0f, exponent), sums);
  __syncthreads();
  toResiduals<kThreads>(a, brick, exponent, sums);
}

/// One block a brick, one group of lanes a pair.
template <Pass kPass, int kThreads, bool kOwnKernels>
__global__ void __launch_bounds__(kThreads) brickPass(const BrickPassArguments a) {
  __shared__ int sums[kPaddedVoxels];
  const std::uint32_t brick = a.lists.brickOrder[blockIdx.x];
  const Coord corner = a.bricks[brick] * kBrickSide;
  const BrickEntries entries{a.lists.brickBegin[brick], a.lists.brickBegin[brick + 1]};

  if constexpr (kPass == Pass::kGivenGradients)
    loadGiven<kThreads>(a, brick, sums);
  else
    sumBrick<kThreads, kOwnKernels>(a, brick, corner, entries, sums);
  __syncthreads();
  if constexpr (kPass != Pass::kResiduals)
    for (std::uint32_t k = entries.begin + threadIdx.x / kGroup; k < entries.end;
         k += kThreads / kGroup)
      writeMoments<kOwnKernels>(a, k, corner, sums);
}

template <Pass kPass, int kChoice>
void launch(const BrickPassArguments& arguments, cudaStream_t stream) {
  constexpr int kThreads = ThreadsPerBrick::threads(kChoice);
  if (arguments.brickCount == 0) return;
  if (arguments.kernels != nullptr)
    brickPass<kPass, kThreads, true><<<arguments.brickCount, kThreads, 0, stream>>>(arguments);
  else
    brickPass<kPass, kThreads, false><<<arguments.brickCount, kThreads, 0, stream>>>(arguments);
  check(cudaGetLastError(), "starting a pass over the bricks");
}

}  // namespace

void launchGradients(const BrickPassArguments& arguments, int threads, cudaStream_t stream) {
  static_assert(ThreadsPerBrick::kChoices == 3);
  if (threads == ThreadsPerBrick::threads(0))
    launch<Pass::kGradients, 0>(arguments, stream);
  else if (threads == ThreadsPerBrick::threads(1))
    launch<Pass::kGradients, 1>(arguments, stream);
  else
    launch<Pass::kGradients, 2>(arguments, stream);
}

void launchGivenGradients(const BrickPassArguments& arguments, cudaStream_t stream) {
  launch<Pass::kGivenGradients, 1>(arguments, stream);
}

void launchResiduals(const BrickPassArguments& arguments, cudaStream_t stream) {
  launch<Pass::kResiduals, 1>(arguments, stream);
}

}  // namespace esvr::cuda
