#include "render/cuda/grids_draw.h"

#include "core/cuda/launch.h"
#include "render/cuda/march_tile.cuh"

namespace esvr::cuda {
namespace {

/// Asks for missing bricks of all grids.
struct AskingGrids {
  const BrickDemand* demand;
  int left;  ///< number of further bricks that the ray asks for

  __device__ void entered(int grid, std::uint32_t slot) const { stamp(demand[grid], slot); }
  __device__ bool wantsMore(int grid, std::uint32_t brick, std::uint32_t slot) {
    askFor(demand[grid], brick, slot);
    return left-- > 0;
  }
};

/// Marches the ray of a pixel. \return whether it ends
template <int kGrids>
__device__ bool marchRay(const GridsDrawArguments& a, const TilePixel& pixel, int2 range,
                         GridsProgress& ray) {
  const MarchSamples samples =
      samplesOf(a.scene.scene, pixel.column, pixel.row,
                {a.band.firstSample + double(range.x), a.band.firstSample + double(range.y)});
  AskingGrids asking{a.demand, a.ahead};
  return marchGrids<kGrids>(a.scene, a.slots, samples, ray, asking);
}

template <int kGrids>
__global__ void __launch_bounds__(kMarchTilePixels)
    marchGridsKernel(const GridsDrawArguments a, const WaitingTiles<KeptGridsRay> w) {
  const TileWork<KeptGridsRay> work(w);
  const int2 range = a.band.ranges[work.tile];
  if (range.x > range.y) return;
  const auto march = [&](const TilePixel& pixel, GridsProgress& ray) {
    return marchRay<kGrids>(a, pixel, range, ray);
  };
  const bool ended = goOn<GridsProgress>(a.band, w, work, march, [&](const GridsProgress& ray) {
    return finished<kGrids>(a.scene, ray);
  });
  if (a.waitingCount != nullptr) listIfWaiting(ended, work.entry, a.waitingCount, a.waiting);
}

using GridsKernel = void (*)(GridsDrawArguments, WaitingTiles<KeptGridsRay>);
constexpr GridsKernel kKernels[kMostGrids] = {marchGridsKernel<1>, marchGridsKernel<2>,
                                              marchGridsKernel<3>, marchGridsKernel<4>};

}  // namespace

void launchMarch(const GridsDrawArguments& a, const WaitingTiles<KeptGridsRay>& w,
                 cudaStream_t stream) {
  const unsigned blocks = w.count == 0 ? unsigned(a.band.tiles()) : w.count;
  kKernels[a.grids - 1]<<<blocks, kMarchTilePixels, 0, stream>>>(a, w);
  check(cudaGetLastError(), "marching bricks of several grids");
}

}  // namespace esvr::cuda
