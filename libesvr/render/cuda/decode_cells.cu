#include "core/cell_corner.h"
#include "core/cuda/check.h"
#include "core/cuda/integer_sum.cuh"
#include "core/cuda/launch.h"
#include "core/cuda/reduce.cuh"
#include "core/cuda/thread_number.cuh"
#include "field/line_math.h"
#include "render/cuda/decode_cells.h"

namespace esvr::cuda {
namespace {

constexpr int kThreads = 256, kWarps = kThreads / kWarp;

/// The brick that a block decodes.
struct BlockBrick {
  std::uint32_t number;
  Coord corner;  ///< its first voxel
  std::uint32_t begin, end;
};

/// The whole numbers from 0 to kCellBrickSide - 1 within an interval, which is widened a little
/// because of rounding.
struct WholeNumbers {
  int first, count;
};
__device__ WholeNumbers numbersWithin(float middle, float half) {
  constexpr float kPad = 0.01f, kLast = float(kCellBrickSide - 1);
  const int first = int(ceilf(fmaxf(middle - half - kPad, 0.0f)));
  const int last = int(floorf(fminf(middle + half + kPad, kLast)));
  return {first, last - first + 1};
}

__device__ int offsetOf(int x, int y, int z) {
  return (x * kCellBrickSide + y) * kCellBrickSide + z;
}

/// An ellipsoid relative to a brick.
struct Placed {
  const LineForm& form;
  float center[3];
  const KernelConstants<float>& kernel;
  float height;  ///< intensity in units of the sum
};

/// Adds the voxels of the line (x, z).
template <class Sum>
__device__ void addLine(const Placed& p, int x, int z, Sum* sums) {
  const LineForm& f = p.form;
  const float dx = float(x) - p.center[0], dz = float(z) - p.center[2];
  const float pzDz[3] = {f.pz[0] * dz, f.pz[1] * dz, f.pz[2] * dz};
  const float closest = closestSquared(f, dx, pzDz);
  if (!(closest < p.kernel.cutoff)) return;
  const float middle = -distanceAlong(f, 0.0f, p.center[1], dx, dz);
  const WholeNumbers ys = numbersWithin(middle, sqrtf((p.kernel.cutoff - closest) / f.a));
  for (int y = ys.first; y < ys.first + ys.count; ++y) {
    const float phi = kernelPhi(p.kernel, squaredAt(f, closest, float(y) - middle));
    addUnits(sums[offsetOf(x, y, z)], p.height * phi);
  }
}

/// Adds an ellipsoid. The lanes of a warp share its lines.
template <class Sum>
__device__ void addEllipsoid(const CellFieldView& field, std::uint32_t i, Coord corner, float units,
                             Sum* sums) {
  const CellForm& cell = field.forms[i];
  const Coord o = field.origins[cell.chunk];
  const Placed p{cell.form,
                 {cell.form.center[0] - float(double(corner.x) - o.x),
                  cell.form.center[1] - float(double(corner.y) - o.y),
                  cell.form.center[2] - float(double(corner.z) - o.z)},
                 field.kernels[i * field.kernelStride],
                 cell.form.intensity * units};
  const WholeNumbers xs = numbersWithin(p.center[0], cell.form.halfX);
  const WholeNumbers zs = numbersWithin(p.center[2], cell.halfZ);
  if (xs.count <= 0 || zs.count <= 0) return;
  for (int n = int(threadIdx.x) % kWarp; n < xs.count * zs.count; n += kWarp)
    addLine(p, xs.first + n / zs.count, zs.first + n % zs.count, sums);
}

/// The exponent of the finest unit in which no sum can overflow. Ends with a barrier.
template <class Sum>
__device__ int sumExponent(const CellFieldView& field, const BlockBrick& brick) {
  float largest = 0.0f;
  for (std::uint32_t k = brick.begin + threadIdx.x; k < brick.end; k += kThreads)
    largest = fmaxf(largest, fabsf(field.forms[field.ellipsoid[k]].form.intensity));
  return unitExponent(blockMax<kThreads>(largest), brick.end - brick.begin,
                      sizeof(Sum) > sizeof(int) ? kLimits64 : kLimits32);
}

/// Sums the ellipsoids of a brick; ends with a barrier. \return the size of a unit
template <class Sum>
__device__ float sumBrick(const CellFieldView& field, const BlockBrick& brick, Sum* sums) {
  for (int v = int(threadIdx.x); v < kCellBrickVoxels; v += kThreads) sums[v] = 0;
  const int exponent = sumExponent<Sum>(field, brick);  // has a barrier
  const float units = ldexpf(1.0f, exponent);
  for (std::uint32_t k = brick.begin + threadIdx.x / kWarp; k < brick.end; k += kWarps)
    addEllipsoid(field, field.ellipsoid[k], brick.corner, units, sums);
  __syncthreads();
  return ldexpf(1.0f, -exponent);
}

/// True if a voxel lies in a brick whose voxels may differ from the background.
__device__ bool mayDiffer(const CellFieldView& field, std::uint32_t brick, int x, int y, int z) {
  if (field.corners == nullptr) return true;
  const int corner = cornerAt({x >> kBrickLog2, y >> kBrickLog2, z >> kBrickLog2});
  return (field.corners[brick] >> corner) & 1u;
}

/// Writes the voxels. \return whether one of this thread's is not the background
template <class Sum>
__device__ bool writeVoxels(const CellFieldView& field, const BlockBrick& brick, float unit,
                            const Sum* sums, float* out) {
  bool any = false;
  for (int v = int(threadIdx.x); v < kCellBrickVoxels; v += kThreads) {
    const int x = v / (kCellBrickSide * kCellBrickSide);
    const int y = v / kCellBrickSide % kCellBrickSide, z = v % kCellBrickSide;
    const float value = mayDiffer(field, brick.number, x, y, z)
                            ? field.rule(field.rule.background + float(sums[v]) * unit)
                            : field.rule.background;
    any |= value != field.rule.background;
    out[v] = value;
  }
  return any;
}

template <class Sum>
__device__ bool decode(const CellFieldView& field, const BlockBrick& brick, Sum* sums, float* out) {
  const float unit = sumBrick(field, brick, sums);
  return writeVoxels(field, brick, unit, sums, out);
}

__device__ float* valuesOf(const DecodeArguments& a, std::uint32_t slot) {
  return a.pages[slot >> BrickSlotsView::kPageLog2] +
         std::size_t(slot & (BrickSlotsView::kPageSlots - 1)) * kCellBrickVoxels;
}

/// Each block decodes one brick.
__global__ void __launch_bounds__(kThreads) decodeKernel(const DecodeArguments a) {
  __shared__ long long sums[kCellBrickVoxels];
  const SlotOfBrick wanted = a.wanted[blockIdx.x];
  const BlockBrick brick{wanted.brick, a.field.origin + a.field.bricks[wanted.brick] * kBrickSide,
                         a.field.begin[wanted.brick], a.field.begin[wanted.brick + 1]};
  float* const out = valuesOf(a, wanted.slot);
  const bool narrow = brick.end - brick.begin <= kMaxNarrowEntries;
  const bool mine = narrow ? decode(a.field, brick, reinterpret_cast<int*>(sums), out)
                           : decode(a.field, brick, sums, out);
  const bool any = __syncthreads_or(mine) != 0;
  if (threadIdx.x != 0) return;
  a.occupied[blockIdx.x] = any ? 1 : 0;
  a.slotOf[wanted.brick] = any ? wanted.slot : BrickSlotsView::kVacant;
}

__global__ void setSlots(const SlotOfBrick* changes, std::uint32_t count, std::uint32_t* slotOf) {
  const std::size_t n = threadNumber();
  if (n < count) slotOf[changes[n].brick] = changes[n].slot;
}

}  // namespace

void launchDecode(const DecodeArguments& a, cudaStream_t stream) {
  if (a.count == 0) return;
  decodeKernel<<<a.count, kThreads, 0, stream>>>(a);
  check(cudaGetLastError(), "decoding bricks");
}

void launchSetSlots(const SlotOfBrick* changes, std::uint32_t count, std::uint32_t* slotOf,
                    cudaStream_t stream) {
  if (count == 0) return;
  setSlots<<<blocksFor(count, kBlock), kBlock, 0, stream>>>(changes, count, slotOf);
  check(cudaGetLastError(), "setting the slots of bricks");
}

}  // namespace esvr::cuda
