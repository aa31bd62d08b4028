// Decodes bricks of cells from ellipsoids, and averages them for coarser levels of detail.
#include "core/cuda/integer_sum.cuh"
#include "core/cuda/reduce.cuh"
#include "core/cuda/runtime.h"
#include "core/geometry.h"
#include "field/coarser_field.h"
#include "field/line_form.h"
#include "field/voxel_rule.h"
#include "render/cuda/cell_store.h"

namespace esvr::cuda {
namespace {

constexpr int kDecodeThreads = 256, kWarps = kDecodeThreads / kWarp;

/// The brick of the field's level that a block decodes.
struct BlockBrick {
  std::uint32_t number;  ///< from the first brick of the level
  Coord corner;          ///< its first voxel
  std::uint32_t begin, end;
};
__device__ BlockBrick blockBrick(const CellFieldView& field, std::uint32_t number) {
  const LevelBricks& level = field.levels[field.level];
  const std::uint32_t n = number - level.first;
  return {n, level.origin + level.bricks[n] * kBrickSide, field.begin[n], field.begin[n + 1]};
}

/// The voxels of a brick that are decoded: those of its cells (side 9), or its own (side 8).
template <int kSide>
struct Cube {
  static constexpr int kVoxels = kSide * kSide * kSide;

  __device__ static int offset(int x, int y, int z) { return (x * kSide + y) * kSide + z; }
  __device__ static Coord place(int offset) {
    return {offset / (kSide * kSide), offset / kSide % kSide, offset % kSide};
  }
};

/// The whole numbers from 0 to kSide - 1 within an interval, which is widened a little because of
/// rounding.
struct WholeNumbers {
  int first, count;
};
template <int kSide>
__device__ WholeNumbers numbersWithin(float middle, float half) {
  constexpr float kPad = 0.01f, kLast = float(kSide - 1);
  const int first = int(ceilf(fmaxf(middle - half - kPad, 0.0f)));
  const int last = int(floorf(fminf(middle + half + kPad, kLast)));
  return {first, last - first + 1};
}

/// An ellipsoid relative to a brick.
struct Placed {
  const LineForm& form;
  float center[3];
  const KernelConstants<float>& kernel;
  float height;  ///< intensity in units of the sum
};

/// Adds the voxels of the line (x, z).
template <int kSide, class Sum>
__device__ void addLine(const Placed& p, int x, int z, Sum* sums) {
  const LineForm& f = p.form;
  const float dx = float(x) - p.center[0], dz = float(z) - p.center[2];
  const float pzDz[3] = {f.pz[0] * dz, f.pz[1] * dz, f.pz[2] * dz};
  const float closest = closestSquared(f, dx, pzDz);
  if (!(closest < p.kernel.cutoff)) return;
  const float middle = -distanceAlong(f, 0.0f, p.center[1], dx, dz);
  const WholeNumbers ys = numbersWithin<kSide>(middle, sqrtf((p.kernel.cutoff - closest) / f.a));
  for (int y = ys.first; y < ys.first + ys.count; ++y) {
    const float phi = kernelPhi(p.kernel, squaredAt(f, closest, float(y) - middle));
    addUnits(sums[Cube<kSide>::offset(x, y, z)], p.height * phi);
  }
}

/// The corner of a brick relative to the origin of a chunk. Most fields have one chunk.
struct CornerInChunk {
  std::uint32_t chunk;
  float x, y, z;
};
__device__ CornerInChunk cornerIn(const CellFieldView& field, const Coord& corner,
                                  std::uint32_t chunk) {
  const Coord o = field.origins[chunk];
  return {chunk, float(double(corner.x) - o.x), float(double(corner.y) - o.y),
          float(double(corner.z) - o.z)};
}

/// Adds an ellipsoid. The lanes of a warp share its lines.
template <int kSide, class Sum>
__device__ void addEllipsoid(const CellFieldView& field, std::uint32_t i,
                             const CornerInChunk& corner, float units, Sum* sums) {
  const CellForm& cell = field.forms[i];
  const Placed p{cell.form,
                 {cell.form.center[0] - corner.x, cell.form.center[1] - corner.y,
                  cell.form.center[2] - corner.z},
                 field.kernels[i * field.kernelStride],
                 cell.form.intensity * units};
  const WholeNumbers xs = numbersWithin<kSide>(p.center[0], cell.form.halfX);
  const WholeNumbers zs = numbersWithin<kSide>(p.center[2], cell.halfZ);
  if (xs.count <= 0 || zs.count <= 0) return;
  const float perPlane = 1.0f / float(zs.count);
  for (int n = int(threadIdx.x) % kWarp; n < xs.count * zs.count; n += kWarp) {
    const int plane = int((float(n) + 0.5f) * perPlane);  // n / zs.count, as n is below 81
    addLine<kSide>(p, xs.first + plane, zs.first + n - plane * zs.count, sums);
  }
}

/// Adds the ellipsoids of a brick. Each warp takes one at a time.
template <int kSide, class Sum>
__device__ void addEllipsoids(const CellFieldView& field, const BlockBrick& brick, float units,
                              Sum* sums) {
  CornerInChunk corner = cornerIn(field, brick.corner, 0);
  for (std::uint32_t k = brick.begin + threadIdx.x / kWarp; k < brick.end; k += kWarps) {
    const std::uint32_t i = field.ellipsoid[k], chunk = field.forms[i].chunk;
    if (chunk != corner.chunk) corner = cornerIn(field, brick.corner, chunk);
    addEllipsoid<kSide>(field, i, corner, units, sums);
  }
}

/// The exponent of the finest unit in which no sum can overflow. Ends with a barrier.
template <class Sum>
__device__ int sumExponent(const CellFieldView& field, const BlockBrick& brick) {
  float largest = 0.0f;
  for (std::uint32_t k = brick.begin + threadIdx.x; k < brick.end; k += kDecodeThreads)
    largest = fmaxf(largest, fabsf(field.forms[field.ellipsoid[k]].form.intensity));
  return unitExponent(blockMax<kDecodeThreads>(largest), brick.end - brick.begin,
                      sizeof(Sum) > sizeof(int) ? kLimits64 : kLimits32);
}

/// Sums the ellipsoids of a brick; ends with a barrier. \return the size of a unit
template <int kSide, class Sum>
__device__ float sumBrick(const CellFieldView& field, const BlockBrick& brick, Sum* sums) {
  for (int v = int(threadIdx.x); v < Cube<kSide>::kVoxels; v += kDecodeThreads) sums[v] = 0;
  const int exponent = sumExponent<Sum>(field, brick);  // has a barrier
  const float units = ldexpf(1.0f, exponent);
  addEllipsoids<kSide>(field, brick, units, sums);
  __syncthreads();
  return ldexpf(1.0f, -exponent);
}

/// The corner of a brick at which the brick of a voxel lies.
__device__ int cornerOf(const Coord& voxel) {
  return cornerAt({voxel.x >> kBrickLog2, voxel.y >> kBrickLog2, voxel.z >> kBrickLog2});
}

/// True if a voxel lies in a brick whose voxels may differ from the background.
__device__ bool mayDiffer(const CellFieldView& field, std::uint32_t brick, int corner) {
  return field.corners == nullptr || (field.corners[brick] >> corner & 1u) != 0;
}

__device__ bool isAlwaysActive(const CellFieldView& field, const Coord& voxel) {
  for (std::uint32_t n = 0; n < field.alwaysActiveCount; ++n)
    if (field.alwaysActive[n] == voxel) return true;
  return false;
}

/// Whether a voxel of this settled value is active, apart from the box. \param local  its place in the brick
__device__ bool isActive(const CellFieldView& field, const BlockBrick& brick, const Coord& local,
                         float settled) {
  if (field.masks == nullptr)
    return field.rule.isActive(settled) || isAlwaysActive(field, brick.corner + local);
  const std::uint32_t mask = field.maskOf[brick.number * kCellCorners + cornerOf(local)];
  return mask != CellFieldView::kNoMask && field.masks[mask].test(voxelOffset(localOf(local)));
}

/// The voxel that a sum becomes. \param local  its place in the brick
__device__ float voxelOf(const CellFieldView& field, const BlockBrick& brick, const LocalBox& box,
                         const Coord& local, float sum) {
  if (!mayDiffer(field, brick.number, cornerOf(local))) return field.rule.background;
  const float settled = field.rule.settled(sum);
  const bool active =
      box.contains(local.x, local.y, local.z) && isActive(field, brick, local, settled);
  const float value = active ? settled : field.rule.inactiveValue(settled);
  if (field.level == 0) return value;
  const float share = shareWithin(field.boxOfGrid, field.level, brick.corner + local);
  return share < 1.0f ? brick_march::between(field.rule.background, value, share) : value;
}

/// Decodes a brick into memory of any kind. \return whether one of this thread's voxels is not the
/// background
template <int kSide, class Sum>
__device__ bool decodeAs(const CellFieldView& field, const BlockBrick& brick, Sum* sums,
                         float* out) {
  const float unit = sumBrick<kSide>(field, brick, sums);
  const LocalBox box = localBox(field.box, brick.corner, kSide - 1);
  bool any = false;
  for (int v = int(threadIdx.x); v < Cube<kSide>::kVoxels; v += kDecodeThreads) {
    const float value = voxelOf(field, brick, box, Cube<kSide>::place(v),
                                field.rule.background + float(sums[v]) * unit);
    any |= value != field.rule.background;
    out[v] = value;
  }
  return any;
}

template <int kSide>
using Sums = long long[Cube<kSide>::kVoxels];  // or int

template <int kSide>
__device__ bool decode(const CellFieldView& field, const BlockBrick& brick, Sums<kSide>& sums,
                       float* out) {
  const bool narrow = brick.end - brick.begin <= kMaxNarrowEntries;
  return narrow ? decodeAs<kSide>(field, brick, reinterpret_cast<int*>(sums), out)
                : decodeAs<kSide>(field, brick, sums, out);
}

__device__ float* valuesOf(const DecodeArguments& a, std::uint32_t slot) {
  return a.pages[slot >> BrickSlotsView::kPageLog2] +
         std::size_t(slot & (BrickSlotsView::kPageSlots - 1)) * kCellBrickVoxels;
}

__device__ bool belongs(const LevelBricks& level, std::uint32_t brick) {
  return brick - level.first < level.count;  // wraps around for a smaller number
}

/// Each block decodes one brick of the field's level.
__global__ void __launch_bounds__(kDecodeThreads) decodeKernel(const DecodeArguments a) {
  __shared__ Sums<kCellBrickSide> sums;
  const std::uint32_t number = a.bricks[blockIdx.x];
  if (!belongs(a.field.levels[a.field.level], number)) return;
  const bool any = decode<kCellBrickSide>(a.field, blockBrick(a.field, number), sums,
                                          valuesOf(a, *(a.lastSlot - blockIdx.x)));
  if (__syncthreads_or(any) != 0 && threadIdx.x == 0) a.occupied[blockIdx.x] = 1;
}

/// The number of a brick of level 0, or kNoCells. \param place  in bricks, in index space
__device__ std::uint32_t numberAt(const BrickTableView& table, const Coord& place) {
  const Coord low = place * kBrickSide - table.origin;
  return brick_march::inside(table, low) ? brick_march::find(table, low).brick : kNoCells;
}

/// Memory of a block that averages.
struct Averaging {
  Sums<kBrickSide> sums;
  float voxels[kBrickVoxels];
};

/// Decodes the voxels of a brick of level 0 and averages them down to a level, at most 3. The means
/// are the first of the voxels afterwards. Ends with a barrier.
__device__ void averageBrick(const CellFieldView& field, const Coord& place, int level,
                             Averaging& m) {
  const std::uint32_t number = numberAt(field.table, place);
  if (number == kNoCells)
    for (int v = int(threadIdx.x); v < kBrickVoxels; v += kDecodeThreads)
      m.voxels[v] = field.rule.background;
  else
    (void)decode<kBrickSide>(field, blockBrick(field, number), m.sums, m.voxels);
  __syncthreads();
  if (number == kNoCells) return;
  for (int side = kBrickSide / 2; side >= kBrickSide >> level; side /= 2) {
    const int v = int(threadIdx.x);
    const bool mine = v < side * side * side;
    float mean = 0.0f;
    if (mine) {
      float eight[kCellCorners];
      for (int c = 0; c < kCellCorners; ++c) {
        const Coord finer =
            Coord{v / (side * side), v / side % side, v % side} * 2 + stepToCorner(c);
        eight[c] = m.voxels[(finer.x * 2 * side + finer.y) * 2 * side + finer.z];
      }
      mean = meanOf(eight);
    }
    __syncthreads();
    if (mine) m.voxels[v] = mean;
    __syncthreads();
  }
}

/// The number that every third bit of n makes.
__device__ int everyThirdBit(int n) {
  int bits = 0;
  for (int b = 0; n >> (3 * b) != 0; ++b) bits |= (n >> (3 * b) & 1) << b;
  return bits;
}

/// The mean of a cube of 2^finer bricks along each side, on the first thread.
/// \param first  place of its first brick
__device__ float meanOfBricks(const CellFieldView& field, const Coord& first, int finer,
                              Averaging& m) {
  constexpr int kMostPairs = 3 * (kLevels - 1 - kBrickLog2);
  float waiting[kMostPairs + 1];  // means of 2^i bricks that wait for the next ones
  for (int n = 0; n < 1 << (3 * finer); ++n) {
    const Coord step{everyThirdBit(n >> 2), everyThirdBit(n >> 1), everyThirdBit(n)};
    averageBrick(field, first + step, kBrickLog2, m);
    float mean = m.voxels[0];
    int pairs = 0;
    for (; (n >> pairs & 1) != 0; ++pairs) mean = meanOf(waiting[pairs], mean);
    waiting[pairs] = mean;
    __syncthreads();
  }
  return waiting[3 * finer];
}

/// Writes one voxel of a coarser brick. \param at  its place in the brick; beyond it: nothing
__device__ bool writeVoxel(const CellFieldView& field, const Coord& at, float value, float* out) {
  if (at.x >= kCellBrickSide || at.y >= kCellBrickSide || at.z >= kCellBrickSide) return false;
  out[Cube<kCellBrickSide>::offset(at.x, at.y, at.z)] = value;
  return value != field.rule.background;
}

/// Each block makes the voxels of a coarser brick that lie in one cube. The cube is a brick of
/// level 0, or as large as one voxel of the level if that is larger.
__global__ void __launch_bounds__(kDecodeThreads)
    averageKernel(const DecodeArguments a, int level, int cubes) {
  __shared__ Averaging memory;
  const LevelBricks& bricks = a.field.levels[level];
  const std::uint32_t number = a.bricks[blockIdx.x];
  if (!belongs(bricks, number)) return;
  float* const out = valuesOf(a, *(a.lastSlot - blockIdx.x));
  const int n = int(blockIdx.y);
  const Coord cube{n / (cubes * cubes), n / cubes % cubes, n % cubes};
  const Coord corner = bricks.origin + bricks.bricks[number - bricks.first] * kBrickSide;
  bool any = false;
  if (level <= kBrickLog2) {
    const int side = kBrickSide >> level;  // voxels that the cube has
    averageBrick(a.field,
                 {corner.x / side + cube.x, corner.y / side + cube.y, corner.z / side + cube.z},
                 level, memory);
    const int v = int(threadIdx.x);
    if (v < side * side * side)
      any = writeVoxel(a.field, cube * side + Coord{v / (side * side), v / side % side, v % side},
                       memory.voxels[v], out);
  } else {
    const int finer = level - kBrickLog2;
    const float mean = meanOfBricks(a.field, (corner + cube) * (1 << finer), finer, memory);
    if (threadIdx.x == 0) any = writeVoxel(a.field, cube, mean, out);
  }
  if (__syncthreads_or(any) != 0 && threadIdx.x == 0) a.occupied[blockIdx.x] = 1;
}

/// Cubes along a side of a coarser brick.
int cubesAlong(int level) {
  if (level > kBrickLog2) return kCellBrickSide;
  const int side = kBrickSide >> level;
  return (kCellBrickSide + side - 1) / side;
}

}  // namespace

void launchDecode(const DecodeArguments& a, int level, cudaStream_t stream) {
  if (a.count == 0) return;
  const int cubes = cubesAlong(level);
  if (level == a.field.level)
    decodeKernel<<<a.count, kDecodeThreads, 0, stream>>>(a);
  else
    averageKernel<<<dim3(a.count, unsigned(cubes * cubes * cubes)), kDecodeThreads, 0, stream>>>(
        a, level, cubes);
  check(cudaGetLastError(), "decoding bricks");
}

}  // namespace esvr::cuda
