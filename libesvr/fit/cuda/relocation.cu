#include "fit/cuda/relocation.h"

#include <thrust/iterator/discard_iterator.h>

#include <algorithm>
#include <cmath>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>
#include <limits>

#include "core/brick_index.h"
#include "core/cuda/device_buffer.h"
#include "core/cuda/reduce.cuh"
#include "core/cuda/runtime.h"
#include "esvr/volume.h"

namespace esvr::cuda {

// --- The least useful ellipsoids.

namespace {

__global__ void writeKeys(const StepArguments a, std::uint32_t graceSteps, float* keys,
                          std::uint32_t* places, std::uint32_t* settled) {
  const std::size_t i = threadNumber();
  if (i >= a.ellipsoidCount) return;
  const bool old = a.states[i].steps >= graceSteps;
  places[i] = i;
  keys[i] = std::numeric_limits<float>::infinity();
  if (!old) return;
  const Usefulness u = a.usefulness[i];
  keys[i] = float(removalError(a.ellipsoids[i].intensity, double(u.phi2), double(u.rPhi)));
  atomicAdd(settled, 1u);
}

}  // namespace

EllipsoidRanking::EllipsoidRanking(cudaStream_t stream)
    : stream_(stream),
      keys_(stream),
      sortedKeys_(stream),
      places_(stream),
      sortedPlaces_(stream),
      settled_(stream),
      temporary_(stream) {}

EllipsoidRanking::Chosen EllipsoidRanking::leastUseful(const StepArguments& fit, std::size_t count,
                                                       int graceSteps) {
  const std::size_t n = fit.ellipsoidCount;
  if (n == 0) return {nullptr, 0};
  std::uint32_t* const settled = settled_.reserve(1);
  check(cudaMemsetAsync(settled, 0, sizeof(*settled), stream_), "clearing a counter");
  writeKeys<<<blocksFor(n, kBlock), kBlock, 0, stream_>>>(
      fit, std::uint32_t(graceSteps), keys_.reserve(n), places_.reserve(n), settled);
  check(cudaGetLastError(), "ranking ellipsoids");
  withTemporary(temporary_, "ranking ellipsoids", [&](void* memory, std::size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(memory, bytes, keys_.data(), sortedKeys_.reserve(n),
                                           places_.data(), sortedPlaces_.reserve(n), n, 0,
                                           int(8 * sizeof(float)), stream_);
  });
  return {sortedPlaces_.data(), std::min<std::size_t>(count, downloadValue(settled, stream_))};
}

// --- Voxels of large error.

/// Converts energies to integers. Prefix sums of integers have no rounding, and do not depend on
/// the order of additions.
struct EnergyUnits {
  double scale;  ///< a power of two
  __device__ std::uint64_t operator()(float residual, SignsAllowed signs) const {
    return std::uint64_t(sampleEnergy(residual, signs) * scale);
  }
};

struct SamplingArguments {
  const float* residual;
  const Coord* bricks;
  SignsAllowed signs;
  EnergyUnits units;
  std::uint32_t targetBricks;
  std::uint64_t seed;
};

namespace {

constexpr int kVoxelsPerLane = kBrickVoxels / kWarp;

/// The units in which the energy of all voxels is at most 2^61.
EnergyUnits unitsFor(double loss) { return {std::ldexp(1.0, 60 - std::ilogb(loss))}; }

/// Each warp sums the energy of one brick.
__global__ void brickEnergies(const SamplingArguments a, std::uint64_t* energy) {
  const std::size_t b = warpNumber();
  if (b >= a.targetBricks) return;
  std::uint64_t sum = 0;
  for (int v = int(threadIdx.x % kWarp); v < kBrickVoxels; v += kWarp)
    sum += a.units(a.residual[b * kBrickVoxels + v], a.signs);
  sum = warpSum(sum);
  if (threadIdx.x % kWarp == 0) energy[b] = sum;
}

/// The first brick whose prefix sum exceeds `at`.
__device__ std::uint32_t brickAt(const std::uint64_t* sums, std::uint32_t bricks,
                                 std::uint64_t at) {
  std::uint32_t low = 0, high = bricks - 1;
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (sums[middle] > at)
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

/// The voxel of a brick at which the cumulative energy exceeds `at`. A warp searches together; each
/// lane has kVoxelsPerLane consecutive voxels.
__device__ int voxelAt(const SamplingArguments& a, std::uint32_t brick, std::uint64_t at) {
  const int lane = int(threadIdx.x % kWarp);
  const float* const r =
      a.residual + std::size_t(brick) * kBrickVoxels + std::size_t(lane) * kVoxelsPerLane;
  std::uint64_t own = 0;
  for (int v = 0; v < kVoxelsPerLane; ++v) own += a.units(r[v], a.signs);
  std::uint64_t before = warpSumBelow(own);
  int found = kBrickVoxels;
  if (before <= at && at < before + own)
    for (int v = 0; v < kVoxelsPerLane && found == kBrickVoxels; ++v) {
      before += a.units(r[v], a.signs);
      if (before > at) found = lane * kVoxelsPerLane + v;
    }
  return warpMin(found);
}

/// Systematic sampling as on the CPU. Each warp draws one voxel.
__global__ void sampleVoxelsKernel(const SamplingArguments a, const std::uint64_t* sums,
                                   std::uint32_t count, Coord* out) {
  const std::size_t n = warpNumber();
  if (n >= count) return;
  const std::uint64_t total = sums[a.targetBricks - 1];
  const double share = double(total) / count;
  const auto wanted = std::uint64_t((double(n) + sampleUniform(a.seed, n)) * share);
  const std::uint64_t at = wanted < total ? wanted : total - 1;
  const std::uint32_t brick = brickAt(sums, a.targetBricks, at);
  const int voxel = voxelAt(a, brick, at - (brick > 0 ? sums[brick - 1] : 0));
  if (threadIdx.x % kWarp == 0) out[n] = a.bricks[brick] * kBrickSide + voxelLocal(voxel);
}

struct SameVoxel {
  __host__ __device__ bool operator()(const Coord& a, const Coord& b) const {
    return sameBrick(a, b);
  }
};

}  // namespace

VoxelSampling::VoxelSampling(cudaStream_t stream)
    : stream_(stream),
      energy_(stream),
      sums_(stream),
      drawn_(stream),
      voxels_(stream),
      count_(stream),
      temporary_(stream) {}

DeviceSampling VoxelSampling::draw(const float* residual, double loss, const Coord* bricks,
                                   const SamplingOptions& options) {
  if (!(loss > 0.0) || options.count == 0) return {};
  const auto targets = std::uint32_t(options.targetBricks);
  const SamplingArguments a{residual, bricks, options.signs, unitsFor(loss), targets, options.seed};
  const std::uint64_t total = sumEnergies(a);
  if (total == 0) return {};
  const std::uint32_t count = count32(options.count, "voxels to draw");
  Coord* const drawn = drawn_.reserve(count);
  sampleVoxelsKernel<<<blocksFor(options.count * kWarp, kBlock), kBlock, 0, stream_>>>(
      a, sums_.data(), count, drawn);
  check(cudaGetLastError(), "drawing voxels");
  return {voxels_.reserve(count), keepEachOnce(count), double(total) / a.units.scale / count};
}

std::uint64_t VoxelSampling::sumEnergies(const SamplingArguments& a) {
  std::uint64_t* const energy = energy_.reserve(a.targetBricks);
  std::uint64_t* const sums = sums_.reserve(a.targetBricks);
  brickEnergies<<<blocksFor(std::size_t(a.targetBricks) * kWarp, kBlock), kBlock, 0, stream_>>>(
      a, energy);
  check(cudaGetLastError(), "summing energies");
  withTemporary(temporary_, "summing energies", [&](void* memory, std::size_t& bytes) {
    return cub::DeviceScan::InclusiveSum(memory, bytes, energy, sums, a.targetBricks, stream_);
  });
  return downloadValue(sums + a.targetBricks - 1, stream_);
}

std::uint32_t VoxelSampling::keepEachOnce(std::uint32_t count) {
  // Repeated draws of a voxel are adjacent.
  const SameVoxel same;
  withTemporary(temporary_, "listing drawn voxels", [&](void* memory, std::size_t& bytes) {
    return cub::DeviceSelect::UniqueByKey(memory, bytes, drawn_.data(), drawn_.data(),
                                          voxels_.data(), thrust::make_discard_iterator(),
                                          count_.reserve(1), count, same, stream_);
  });
  return downloadValue(count_.data(), stream_);
}

// --- New ellipsoids.

namespace {

constexpr int kBricksAround = 27;

/// The residuals around a voxel. The window is smaller than a brick, so it lies in the voxel's
/// brick and its 26 neighbours. Each lane of a warp holds the number of one of these bricks.
class Surroundings {
 public:
  __device__ Surroundings(const SeedArguments& a, Coord voxel)
      : residual_(a.residual), local_(localOf(voxel)) {
    const int lane = int(threadIdx.x % kWarp);
    const Coord step{lane / 9 - 1, lane / 3 % 3 - 1, lane % 3 - 1};
    number_ = lane < kBricksAround ? a.bricks.find(brickOf(voxel) + step) : kNoBrick;
  }
  /// The residual at an offset. All lanes must call it together. \param d  offset from the voxel
  __device__ float at(Coord d) const {
    const Coord place = local_ + d, step = brickOf(place);
    const int holder = (step.x + 1) * 9 + (step.y + 1) * 3 + step.z + 1;
    const std::uint32_t brick = __shfl_sync(kAllLanes, number_, holder);
    if (brick == kNoBrick) return 0.0f;
    return residual_[std::size_t(brick) * kBrickVoxels + voxelOffset(localOf(place))];
  }

 private:
  const float* residual_;
  Coord local_;
  std::uint32_t number_;
};

__device__ SeedMoments momentsAround(const Surroundings& around, double sign, int w) {
  SeedMoments m;
  const int side = 2 * w + 1, cube = side * side * side;
  for (int first = 0; first < cube; first += kWarp) {
    const int n = min(first + int(threadIdx.x % kWarp), cube - 1);
    const Coord d{n / (side * side) - w, n / side % side - w, n % side - w};
    const double r = sign * double(around.at(d));
    if (first + int(threadIdx.x % kWarp) < cube && r > 0.0 && inSeedWindow(d, w)) m.add(d, r);
  }
  for (double* part :
       {&m.mass, &m.energy, &m.x, &m.y, &m.z, &m.xx, &m.yy, &m.zz, &m.xy, &m.xz, &m.yz})
    *part = warpSum(*part);
  return m;
}

/// Each warp makes one seed.
__global__ void placeSeeds(const SeedArguments a) {
  const std::size_t n = warpNumber();
  if (n >= a.count) return;
  const Coord voxel = a.voxels[n];
  const Surroundings around(a, voxel);
  const double r = double(around.at({0, 0, 0}));
  const SeedMoments moments = momentsAround(around, r < 0.0 ? -1.0 : 1.0, a.window);
  if (threadIdx.x % kWarp != 0) return;
  const std::uint32_t place = a.into != nullptr ? a.into[n] : a.firstPlace + std::uint32_t(n);
  a.ellipsoids[place] = seedFromMoments(voxel, r, moments, {a.unitVariance, a.intensity, a.share});
  a.states[place] = AdamState{};
}

}  // namespace

void launchPlaceSeeds(const SeedArguments& a, cudaStream_t stream) {
  if (a.count == 0) return;
  placeSeeds<<<blocksFor(std::size_t(a.count) * kWarp, kBlock), kBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "placing seeds");
}

}  // namespace esvr::cuda
