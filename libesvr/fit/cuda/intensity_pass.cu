#include "core/cuda/check.h"
#include "fit/cuda/intensity_pass.h"
#include "fit/cuda/launch.h"
#include "fit/cuda/pair_lines.cuh"

namespace esvr::cuda {
namespace {

constexpr unsigned kAllLanes = 0xffffffffu;
constexpr int kWarpsOfBrick = kBrickVoxels / kWarp;

enum class Pass { kErrors, kGradient, kNormal };

struct BrickEntries {
  std::uint32_t begin, end;
};

__device__ double warpSum(double value) {
  for (int d = kWarp / 2; d > 0; d /= 2) value += __shfl_xor_sync(kAllLanes, value, d);
  return value;
}
__device__ double warpMax(double value) {
  for (int d = kWarp / 2; d > 0; d /= 2) value = fmax(value, __shfl_xor_sync(kAllLanes, value, d));
  return value;
}

/// Values are summed as integers, whose sum has no order, in units of 2^-exponent: as fine as 31
/// bits allow where all of the brick's ellipsoids have their maximum at one voxel.
__device__ int sumExponent(const IntensityPassArguments& a, BrickEntries entries) {
  constexpr int kBits = 29, kFarthest = 100;
  __shared__ float parts[kBlock / kWarp];
  float largest = 0.0f;
  for (std::uint32_t k = entries.begin + threadIdx.x; k < entries.end; k += kBlock)
    largest = fmaxf(largest, fabsf(a.heights[a.lists.ellipsoid[k]]));
  for (int d = kWarp / 2; d > 0; d /= 2)
    largest = fmaxf(largest, __shfl_xor_sync(kAllLanes, largest, d));
  if (threadIdx.x % kWarp == 0) parts[threadIdx.x / kWarp] = largest;
  __syncthreads();
  for (const float part : parts) largest = fmaxf(largest, part);
  const float bound = largest * float(entries.end - entries.begin);
  return bound > 0.0f ? max(-kFarthest, min(kBits - ilogbf(bound), kFarthest)) : 0;
}

/// Calls visit(place of the voxel, phi) for a lane's share of a pair.
template <class Visit>
__device__ void visitVoxels(const IntensityPassArguments& a, std::uint32_t ellipsoid, Coord corner,
                            Visit&& visit) {
  const PairForm p = a.forms[ellipsoid];
  visitLines(p, corner, a.kernel.cutoff, int(threadIdx.x % kGroup), [&](const PairLine& line) {
    float t = line.t;
    for (int y = line.yBegin; y < line.yEnd; ++y, t += 1.0f)
      visit(line.offset + y * kBrickSide, kernelPhi(a.kernel, squaredAt(p.form, line.closest, t)));
  });
}

/// Calls visit(entry) for the entries of a group of lanes.
template <class Visit>
__device__ void visitEntries(BrickEntries entries, Visit&& visit) {
  for (std::uint32_t k = entries.begin + threadIdx.x / kGroup; k < entries.end;
       k += kBlock / kGroup)
    visit(k);
}

__device__ void addPairs(const IntensityPassArguments& a, Coord corner, BrickEntries entries,
                         float unit, int* sums) {
  visitEntries(entries, [&](std::uint32_t k) {
    const std::uint32_t i = a.lists.ellipsoid[k];
    const float height = a.heights[i] * unit;
    visitVoxels(a, i, corner,
                [&](int at, float phi) { atomicAdd(&sums[at], __float2int_rn(height * phi)); });
  });
}

/// Sums become values, those of exact voxels 0.
__device__ void clearExact(const IntensityPassArguments& a, std::uint32_t brick, float unit,
                           int* sums) {
  const std::uint32_t* const exact =
      a.exact + std::size_t(brick) * IntensityPassArguments::kMaskWords;
  for (int v = int(threadIdx.x); v < kBrickVoxels; v += kBlock) {
    const int at = paddedOffset(v);
    const bool isExact = (exact[v / kWarp] >> (v % kWarp)) & 1u;
    sums[at] = __float_as_int(isExact ? 0.0f : float(sums[at]) * unit);
  }
}

/// One voxel: what a reader has too much, and the residual.
struct Missed {
  double stored;
  float residual;
};
__device__ Missed missedAt(const IntensityPassArguments& a, std::uint32_t brick, int v, float sum) {
  const float wanted =
      brick < a.targetCount ? a.source[std::size_t(brick) * kBrickVoxels + v] : a.sourceBackground;
  const float value = a.fieldBackground + sum;
  const double stored = double(a.stored(value)) - double(wanted);
  return {stored, stored == 0.0 ? 0.0f : value - wanted};
}

/// Sums become residuals. Voxels are summed in one order.
template <bool kMarksExact>
__device__ void toResiduals(const IntensityPassArguments& a, std::uint32_t brick, Coord corner,
                            float unit, int* sums) {
  __shared__ double squares[kWarpsOfBrick], largest[kWarpsOfBrick];
  for (int v = int(threadIdx.x); v < kBrickVoxels; v += kBlock) {
    const int at = paddedOffset(v), warp = v / kWarp;
    const Missed missed = missedAt(a, brick, v, float(sums[at]) * unit);
    sums[at] = __float_as_int(missed.residual);
    const unsigned exact = __ballot_sync(kAllLanes, missed.stored == 0.0);
    const double counted = a.box.contains(corner + voxelLocal(v)) ? missed.stored : 0.0;
    const double square = warpSum(counted * counted), peak = warpMax(fabs(counted));
    if (v % kWarp != 0) continue;
    squares[warp] = square, largest[warp] = peak;
    if (kMarksExact)
      a.exact[std::size_t(brick) * IntensityPassArguments::kMaskWords + std::size_t(warp)] = exact;
  }
  __syncthreads();
  if (threadIdx.x != 0) return;
  StoredError error;
  for (const double part : squares) error.squares += part;
  for (const double part : largest) error.largest = fmax(error.largest, part);
  a.errors[brick] = error;
}

/// Over a group's lanes, on all of them.
__device__ float groupSum(float value) {
  constexpr unsigned kLanes = (1u << kGroup) - 1u;
  const unsigned group = kLanes << (threadIdx.x % kWarp / kGroup * kGroup);
  for (int d = kGroup / 2; d > 0; d /= 2) value += __shfl_xor_sync(group, value, d);
  return value;
}

__device__ void project(const IntensityPassArguments& a, Coord corner, BrickEntries entries,
                        const int* values) {
  visitEntries(entries, [&](std::uint32_t k) {
    PairProjection sum{};
    visitVoxels(a, a.lists.ellipsoid[k], corner, [&](int at, float phi) {
      sum.rPhi += __int_as_float(values[at]) * phi;
      sum.phi2 += phi * phi;
    });
    const PairProjection all{groupSum(sum.rPhi), groupSum(sum.phi2)};
    if (threadIdx.x % kGroup == 0) a.projections[a.lists.pair[k]] = all;
  });
}

/// One block a brick, one group of lanes a pair.
template <Pass kPass>
__global__ void __launch_bounds__(kBlock) intensityPass(const IntensityPassArguments a) {
  __shared__ int sums[kPaddedVoxels];
  const std::uint32_t brick = a.lists.brickOrder[blockIdx.x];
  const Coord corner = a.bricks[brick] * kBrickSide;
  const BrickEntries entries{a.lists.brickBegin[brick], a.lists.brickBegin[brick + 1]};

  for (int v = int(threadIdx.x); v < kPaddedVoxels; v += kBlock) sums[v] = 0;
  const int exponent = sumExponent(a, entries);  // its barrier comes after the zeros
  addPairs(a, corner, entries, ldexpf(1.0f, exponent), sums);
  __syncthreads();
  const float unit = ldexpf(1.0f, -exponent);
  if constexpr (kPass == Pass::kNormal)
    clearExact(a, brick, unit, sums);
  else
    toResiduals<kPass == Pass::kGradient>(a, brick, corner, unit, sums);
  if constexpr (kPass == Pass::kErrors) return;
  __syncthreads();
  project(a, corner, entries, sums);
}

template <Pass kPass>
void launch(const IntensityPassArguments& arguments, cudaStream_t stream) {
  if (arguments.brickCount == 0) return;
  intensityPass<kPass><<<arguments.brickCount, kBlock, 0, stream>>>(arguments);
  check(cudaGetLastError(), "starting a pass of the solve for intensities");
}

/// A warp an ellipsoid.
__global__ void sumProjections(const ProjectionSums s) {
  const std::uint32_t i = (blockIdx.x * kBlock + threadIdx.x) / kWarp;
  if (i >= s.ellipsoidCount) return;
  double rPhi = 0.0, phi2 = 0.0;
  for (std::uint32_t k = s.ellipsoidBegin[i] + threadIdx.x % kWarp; k < s.ellipsoidBegin[i + 1];
       k += kWarp) {
    rPhi += double(s.projections[k].rPhi);
    phi2 += double(s.projections[k].phi2);
  }
  rPhi = warpSum(rPhi), phi2 = warpSum(phi2);
  if (threadIdx.x % kWarp != 0) return;
  if (s.rPhi != nullptr) s.rPhi[i] = rPhi;
  if (s.phi2 != nullptr) s.phi2[i] = phi2;
}

}  // namespace

void launchStoredErrors(const IntensityPassArguments& arguments, cudaStream_t stream) {
  launch<Pass::kErrors>(arguments, stream);
}

void launchIntensityGradient(const IntensityPassArguments& arguments, cudaStream_t stream) {
  launch<Pass::kGradient>(arguments, stream);
}

void launchNormalProduct(const IntensityPassArguments& arguments, cudaStream_t stream) {
  launch<Pass::kNormal>(arguments, stream);
}

void launchProjectionSums(const ProjectionSums& sums, cudaStream_t stream) {
  if (sums.ellipsoidCount == 0) return;
  sumProjections<<<blocksFor(std::size_t(sums.ellipsoidCount) * kWarp, kBlock), kBlock, 0,
                   stream>>>(sums);
  check(cudaGetLastError(), "starting the sums of projections");
}

}  // namespace esvr::cuda
