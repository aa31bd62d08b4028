#include "core/cuda/check.h"
#include "core/cuda/reduce.cuh"
#include "core/cuda/thread_number.cuh"
#include "esvr/sparse_volume.h"
#include "fit/cuda/place_seeds.h"
#include "fit/seed_math.h"

namespace esvr::cuda {
namespace {

constexpr int kNeighbours = 27;

/// The residuals around a voxel. The window is smaller than a brick, so it lies in the voxel's
/// brick and its 26 neighbours. Each lane of a warp holds the number of one of these bricks.
class Surroundings {
 public:
  __device__ Surroundings(const SeedArguments& a, Coord voxel)
      : residual_(a.residual), local_(localOf(voxel)) {
    const int lane = int(threadIdx.x % kWarp);
    const Coord step{lane / 9 - 1, lane / 3 % 3 - 1, lane % 3 - 1};
    number_ = lane < kNeighbours ? a.bricks.find(brickOf(voxel) + step) : kNoBrick;
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
