#include "render/cuda/window_sums.cuh"

namespace esvr::cuda {
namespace {

__device__ void layRay(const VoxelArguments& a, VoxelShared& s, const Place& place,
                       const Work& work) {
  const View& view = a.draw.frame.view;
  const double x = view.planeX(work.firstColumn + place.column);
  const double y = view.planeY(work.firstRow + place.row);
  s.rays[place.ray] = {voxel_window::originOf(view, x, y),
                       scaled(view.directionAt(x, y), a.draw.frame.step / view.unitAlong(x, y))};
}

__device__ float along(const Vec3& v, int axis) {
  return float(axis == 0 ? v[0] : (axis == 1 ? v[1] : v[2]));
}
__device__ WindowPlace inAxes(const Vec3& v, const WindowAxes& axes) {
  return {along(v, axes.slab), along(v, axes.row), along(v, axes.column)};
}

/// Position of the block's first sample on the thread's ray, relative to the window's first voxel.
__device__ WindowPlace firstPlace(const Pass& pass, const SampledRay& ray, double binSample) {
  const WindowAxes& axes = pass.window.axes;
  Vec3 corner;
  for (int i = 0; i < 3; ++i)
    corner[i] =
        i == axes.slab ? pass.origin.slab : (i == axes.row ? pass.origin.row : pass.origin.column);
  const double number = binSample + pass.block.firstSample;
  return inAxes(difference(sum(ray.origin, scaled(ray.apart, number)), corner), axes);
}

__device__ bool hasRay(const Pass& pass, const Place& place) {
  const Block& b = pass.block;
  return place.column >= b.column && place.column < b.column + b.columns && place.row >= b.row &&
         place.row < b.row + b.rows;
}

/// Adds a share of a pass' samples to a ray. Samples count from the block's first.
__device__ void addSamples(const VoxelArguments& a, const VoxelShared& s, const Place& place,
                           const Work& work, int bin, const Share& share, RayState& ray) {
  const SampleRule& rule = a.draw.rule;
  const Pass& pass = s.pass;
  const double toFrame = double(a.draw.frame.firstBin) * kBinSamples;
  const WindowPlace first =
      firstPlace(pass, s.rays[place.ray], toFrame + double(bin) * kBinSamples);
  const WindowPlace apart = inAxes(s.rays[place.ray].apart, pass.window.axes);
  const auto* const values = reinterpret_cast<const float*>(s.values);
  const unsigned long long filled = s.filled, near = filled | filled >> 1;
  const int ofBin = bin * kBinSamples + pass.block.firstSample;
  for (int i = share.first; i < share.end && rule.open(ray); ++i) {
    const float n = float(i);
    const WindowPlace p{first.slab + n * apart.slab, first.row + n * apart.row,
                        first.column + n * apart.column};
    const float number = float(ofBin + i);
    if ((near >> wholeBelow(p.slab) & 1u) == 0) continue;
    if (!(number >= work.firstSample && number <= work.lastSample)) continue;
    const float value = interpolate(values, s.slabs, pass.window.columns, p);
    if (value != rule.background)
      rule.add(ray, value, {float(toFrame) + number, std::uint32_t(ofBin + i)});
  }
}

/// Draws the samples of a pass.
__device__ void drawSamples(const VoxelArguments& a, VoxelShared& s, const Place& place,
                            const Work& work, int bin, RayState& ray) {
  const bool own = hasRay(s.pass, place) && isOpen(s, place);
  addInShares(
      a.draw.rule, s, s.behind, place, work, own, s.pass.block.samples, ray,
      [&](const Share& share, RayState& part) { addSamples(a, s, place, work, bin, share, part); });
}

__device__ void drawBin(const VoxelArguments& a, VoxelShared& s, const Place& place,
                        const Work& work, std::size_t list, int bin, RayState& ray) {
  const std::uint32_t n = a.draw.lists.counts[list];
  const std::uint32_t* const ids = a.draw.lists.entries + (a.draw.lists.ends[list] - n);
  const Units units = unitsFor(a.bound, n);
  const Tile tile{work.firstColumn, work.firstRow};
  const double binSample = double(a.draw.frame.firstBin + bin) * kBinSamples;
  bool planned = planBin(a, s, tile, ids, n, binSample);
  for (; planned || takePass(a.draw.frame, s, tile, binSample); planned = false) {
    layOut(s);
    __syncthreads();
    addList(a, s, ids, n, units.ofOne);
    __syncthreads();
    if (s.filled == 0) continue;
    finishVoxels(a, s, units.one);
    __syncthreads();
    drawSamples(a, s, place, work, bin, ray);
    __syncthreads();
  }
}

__global__ void __launch_bounds__(kThreads, DrawTuning::kBlocksPerMultiprocessor)
    sampleVoxelsKernel(const __grid_constant__ VoxelArguments a) {
  extern __shared__ float4 memory[];
  VoxelShared& s = *reinterpret_cast<VoxelShared*>(memory);
  if (!listsFit(*a.draw.lists.counters, a.draw.lists, a.draw.frame.between)) return;
  const Place place;
  forEachItem(a.draw, s, [&](const TilePart& item) {
    const Work work = workOf(a.draw, item.tile, place);
    if (place.group == 0) layRay(a, s, place, work);
    if (threadIdx.x == 0) bundleTile(a.draw.frame, s, {work.firstColumn, work.firstRow});
    drawItem(a.draw, s, item, place, work, [&](std::size_t list, int bin, RayState& ray) {
      drawBin(a, s, place, work, list, bin, ray);
    });
  });
}

}  // namespace

void launchDrawVoxels(const VoxelArguments& arguments, int multiprocessors, cudaStream_t stream) {
  launchOverTiles(sampleVoxelsKernel, arguments, sizeof(VoxelShared),
                  multiprocessors * DrawTuning::kBlocksPerMultiprocessor, stream);
}

}  // namespace esvr::cuda
