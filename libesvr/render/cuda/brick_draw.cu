#include "render/cuda/brick_draw.h"

#include "core/cuda/launch.h"
#include "render/cuda/march_tile.cuh"

namespace esvr::cuda {
namespace {

/// Asks for missing bricks.
struct Asking {
  const BrickDemand& demand;
  int left;  ///< number of further bricks that the ray asks for

  __device__ void entered(std::uint32_t slot) const { stamp(demand, slot); }
  __device__ bool wantsMore(std::uint32_t brick, std::uint32_t slot) {
    askFor(demand, brick, slot);
    return left-- > 0;
  }
};

/// Marches the ray of a pixel. \return whether it ends
template <MarchCode kCode>
__device__ bool marchRay(const BrickDrawArguments& a, const TilePixel& pixel, int2 range,
                         RayProgress& ray) {
  const double side = LevelFrame{a.scene.bounds.last}.side();
  const SampleRange wanted{(a.band.firstSample + double(range.x)) * side,
                           (a.band.firstSample + double(range.y)) * side};
  Asking asking{a.demand, a.demand.ahead};
  ray.ray.first = 0;  // so that the code for parts of rays is left out
  return marchLevels<kCode>(a.scene, a.slots, pixel.column, pixel.row, wanted, ray, asking);
}

/// Blocks that run on a multiprocessor at the same time. More leave fewer registers to each: 16 were
/// faster than 12 by up to 9 % for scenes of one level, and 8 faster than 16 by 2 % for others (H200).
constexpr int kBlocksOfOne = 16, kBlocksOfMany = 8;

/// The first pass and later ones share the code, because two kernels could be compiled to different
/// roundings.
template <bool kHasOneLevel, bool kIsUsual, bool kIsShaded>
__global__ void __launch_bounds__(kMarchTilePixels,
                                  kHasOneLevel && !kIsShaded ? kBlocksOfOne : kBlocksOfMany)
    marchKernel(const BrickDrawArguments a, const WaitingTiles<KeptRay> w) {
  const TileWork<KeptRay> work(w);
  const int2 range = a.band.ranges[work.tile];
  if (range.x > range.y) return;
  const auto march = [&](const TilePixel& pixel, RayProgress& ray) {
    if (kIsShaded && !work.isNew) ray.shade = w.shades[work.ray()];
    const bool ended = marchRay<MarchCode{kHasOneLevel, kIsUsual, kIsShaded}>(a, pixel, range, ray);
    if (kIsShaded && work.keeps) w.shades[work.ray()] = ray.shade;
    return ended;
  };
  const bool ended = goOn<RayProgress>(
      a.band, w, work, march, [&](const RayProgress& ray) { return finished(a.scene, ray); });
  if (a.demand.slotOf != nullptr)
    listIfWaiting(ended, work.entry, &a.demand.counts->waiting, a.waiting);
}

using MarchKernel = void (*)(BrickDrawArguments, WaitingTiles<KeptRay>);

MarchKernel kernelFor(const MarchCode& code) {
  if (code.isShaded)
    return code.hasOneLevel ? marchKernel<true, false, true> : marchKernel<false, false, true>;
  if (code.hasOneLevel)
    return code.isUsual ? marchKernel<true, true, false> : marchKernel<true, false, false>;
  return code.isUsual ? marchKernel<false, true, false> : marchKernel<false, false, false>;
}

}  // namespace

void launchMarch(const BrickDrawArguments& a, const WaitingTiles<KeptRay>& w, cudaStream_t stream) {
  const unsigned blocks = w.count == 0 ? unsigned(a.band.tiles()) : w.count;
  kernelFor(codeFor(a.scene))<<<blocks, kMarchTilePixels, 0, stream>>>(a, w);
  check(cudaGetLastError(), "marching bricks");
}

}  // namespace esvr::cuda
