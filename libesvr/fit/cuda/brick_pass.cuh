#pragma once
/// Device functions of a pass over the bricks. A block of threads adds up the ellipsoids of a brick
/// as integers in shared memory, whose sum does not depend on the order of the terms. Each group of
/// lanes works on one pair at a time, and divides the lines along y on which the ellipsoid meets
/// the brick among its lanes. The inner loops take as many instructions as the code before them, so
/// both are written for few instructions (docs/lab-notes.md, "The fit on a GPU").

#include "core/cuda/integer_sum.cuh"
#include "core/cuda/reduce.cuh"
#include "esvr/volume.h"
#include "field/line_form.h"
#include "fit/cuda/brick_pass.h"

namespace esvr::cuda {

// --- The lines of a pair.

/// Number of lanes that work on one pair. A support of a few voxels meets a brick on about ten
/// lines.
inline constexpr int kGroup = 8;

/// Distance between the slices (x) of a brick in shared memory. They are padded, so that the voxels
/// of neighbouring lines lie in different memory banks.
inline constexpr int kSliceStride = kBrickSide * kBrickSide + kBrickSide;
inline constexpr int kPaddedVoxels = kSliceStride * kBrickSide;

__device__ inline int paddedOffset(int x, int y, int z) {
  return x * kSliceStride + y * kBrickSide + z;
}
__device__ inline int paddedOffset(int voxel) {
  return voxel + (voxel >> (2 * kBrickLog2)) * kBrickSide;
}

/// The voxels of one line that lie in the support.
struct PairLine {
  int offset;     ///< padded offset of the first voxel
  int count;      ///< number of voxels; 0 or negative if there are none
  float dx, dz;   ///< position relative to the ellipsoid's center
  float closest;  ///< m at the point of the line that is closest to the center
  float t;        ///< distance from that point to the first voxel
};

/// Consecutive voxels of a brick along one axis.
struct Interval {
  float begin;  ///< coordinate of the first voxel
  int first;    ///< the same as an integer
  int count;    ///< number of voxels; 0 or negative if there are none
};

/// The voxels of 0 to 7 that lie in [middle - half, middle + half]. The interval is widened by a
/// hundredth of a voxel because of rounding.
__device__ inline Interval voxelsWithin(float middle, float half) {
  constexpr float kPad = 0.01f, kSide = float(kBrickSide);
  // The lowest bits of a float near 1.5 * 2^23 are those of an integer. Such additions are faster
  // than conversions.
  constexpr float kWhole = 12582912.0f;
  const float low = __fadd_ru(fminf(fmaxf(middle - half - kPad, 0.0f), kSide), kWhole);
  const float high = __fadd_rd(fminf(fmaxf(middle + half + kPad, -1.0f), kSide - 1.0f), kWhole);
  const int first = __float_as_int(low) - __float_as_int(kWhole);
  return {low - kWhole, first, __float_as_int(high) - __float_as_int(low) + 1};
}

/// The (x, z) of the lines that one lane works on. Lines are numbered along z first.
class LinePlaces {
 public:
  /// \param cx, cz  the ellipsoid's center relative to the brick
  __device__ LinePlaces(const Interval& xs, const Interval& zs, float cx, float cz, int lane)
      : depth_(float(zs.count)), endDz_(zs.begin - cz + depth_) {
    const float perDepth = __fdividef(1.0f, depth_);
    const int row = rows(lane, perDepth), step = rows(kGroup, perDepth);
    const int column = lane - row * zs.count;
    stepX_ = float(step), stepZ_ = float(kGroup - step * zs.count);
    stepOffset_ = paddedOffset(step, 0, kGroup - step * zs.count);
    wrapOffset_ = paddedOffset(1, 0, -zs.count);
    dx = xs.begin - cx + float(row), dz = zs.begin - cz + float(column);
    offset = paddedOffset(xs.first + row, 0, zs.first + column);
  }

  /// Moves by kGroup lines.
  __device__ void advance() {
    dx += stepX_, dz += stepZ_, offset += stepOffset_;
    if (dz < endDz_ - 0.5f) return;
    dx += 1.0f, dz -= depth_, offset += wrapOffset_;
  }

  float dx, dz;  ///< position relative to the ellipsoid's center
  int offset;    ///< padded offset of the voxel y = 0

 private:
  /// The rows that the first n lines fill, for n < 64.
  __device__ static int rows(int n, float perDepth) { return int((float(n) + 0.5f) * perDepth); }

  float depth_, endDz_, stepX_, stepZ_;
  int stepOffset_, wrapOffset_;
};

/// Calls visit(line) for the lines that lane `lane` of a group works on.
template <class Visit>
__device__ inline void visitLines(const PairForm& p, Coord corner, float cutoff, int lane,
                                  Visit&& visit) {
  const LineForm& f = p.form;
  const Coord local = corner - p.frame;
  const float cx = f.center[0] - float(local.x), cy = f.center[1] - float(local.y),
              cz = f.center[2] - float(local.z);
  const Interval xs = voxelsWithin(cx, f.halfX), zs = voxelsWithin(cz, p.halfZ);
  if (xs.count <= 0 || zs.count <= 0) return;
  LinePlaces place(xs, zs, cx, cz, lane);
  const float inverseA = __fdividef(1.0f, f.a);
  for (int n = xs.count * zs.count - lane; n > 0; n -= kGroup, place.advance()) {
    const float pzDz[3] = {f.pz[0] * place.dz, f.pz[1] * place.dz, f.pz[2] * place.dz};
    const float closest = closestSquared(f, place.dx, pzDz);
    if (!(closest < cutoff)) continue;
    const float middle = -distanceAlong(f, 0.0f, cy, place.dx, place.dz);
    const Interval ys = voxelsWithin(middle, sqrtf((cutoff - closest) * inverseA));
    visit(PairLine{place.offset + ys.first * kBrickSide, ys.count, place.dx, place.dz, closest,
                   ys.begin - middle});
  }
}

// --- The sums of a brick.

/// The range of a brick's entries in the pair lists.
struct BrickEntries {
  std::uint32_t begin, end;
  [[nodiscard]] __device__ std::uint32_t count() const { return end - begin; }
};

/// The brick that a block works on.
struct BlockBrick {
  std::uint32_t number;
  Coord corner;  ///< lowest voxel
  BrickEntries entries;
};

__device__ inline BlockBrick blockBrick(const PassScene& scene) {
  const std::uint32_t brick = scene.lists.brickOrder[blockIdx.x];
  return {brick,
          scene.bricks[brick] * kBrickSide,
          {scene.lists.brickBegin[brick], scene.lists.brickBegin[brick + 1]}};
}

/// The integers for the sums of short lists and of long lists.
using NarrowSum = int;
using WideSum = long long;

template <class Sum>
inline constexpr bool kIsWide = sizeof(Sum) > sizeof(NarrowSum);

/// True if a brick's list has the length for which this type of sums is meant.
template <class Sum>
__device__ inline bool isFor(const BrickEntries& entries) {
  return kIsWide<Sum> == (entries.count() > kMaxNarrowEntries);
}

/// Calls visit(entry) for the entries that the calling group of lanes works on.
template <int kThreads, class Visit>
__device__ inline void visitEntries(const BrickEntries& entries, Visit&& visit) {
  for (std::uint32_t k = entries.begin + threadIdx.x / kGroup; k < entries.end;
       k += kThreads / kGroup)
    visit(k);
}

/// The exponent of the unit of the sums. It is the finest one for which a sum cannot overflow, even
/// if all ellipsoids of the list have their maximum at one voxel. Ends with a barrier.
/// \param height  height(entry) returns the intensity of an entry
template <class Sum, int kThreads, class Height>
__device__ inline int sumExponent(const BrickEntries& entries, Height&& height) {
  float largest = 0.0f;
  for (std::uint32_t k = entries.begin + threadIdx.x; k < entries.end; k += kThreads)
    largest = fmaxf(largest, fabsf(height(k)));
  return unitExponent(blockMax<kThreads>(largest), entries.count(),
                      kIsWide<Sum> ? kLimits64 : kLimits32);
}

/// Sets the sums to 0, adds all entries, and ends with a barrier.
/// \param height  height(entry) returns the intensity of an entry
/// \param add     add(entry, units) adds the lane's share of an entry to the sums; `units` is the
///                number of units in 1.0
/// \return the size of a unit
template <class Sum, int kThreads, class Height, class Add>
__device__ inline float sumEntries(const BrickEntries& entries, Sum* sums, Height&& height,
                                   Add&& add) {
  for (int v = int(threadIdx.x); v < kPaddedVoxels; v += kThreads) sums[v] = 0;
  const int exponent = sumExponent<Sum, kThreads>(entries, height);  // has a barrier
  const float units = ldexpf(1.0f, exponent);
  visitEntries<kThreads>(entries, [&](std::uint32_t k) { add(k, units); });
  __syncthreads();
  return ldexpf(1.0f, -exponent);
}

/// Replaces a sum by a float in the same memory.
template <class Sum>
__device__ inline void putValue(Sum& sum, float value) {
  sum = __float_as_int(value);
}
template <class Sum>
__device__ inline float valueIn(const Sum& sum) {
  return __int_as_float(int(sum));
}

// --- Residuals and moments. They are templates, so that ellipsoids can share one kernel or have
// their own.

/// One kernel for all ellipsoids.
struct SharedKernel {
  const KernelConstants<float>& kernel;
  __device__ const KernelConstants<float>& of(std::uint32_t) const { return kernel; }
};
/// A kernel for each ellipsoid.
struct OwnKernels {
  const KernelConstants<float>* kernels;
  __device__ const KernelConstants<float>& of(std::uint32_t ellipsoid) const {
    return kernels[ellipsoid];
  }
};

/// The outputs of a pass; those that are not wanted are null.
struct ResidualOutput {
  double* brickLoss;  ///< sum of r^2 of each brick
  float* residual;    ///< kBrickVoxels values for each brick
};

constexpr int kMomentSlots = 16;  // kMoments, rounded up to a power of two
static_assert(kMomentSlots % kGroup == 0, "each lane ends with some of the moments");

/// Computes the kernel from the exponent x = (m - s) log2(e), because a power of two takes the device
/// one instruction. Along a line, m = closest + a t^2, and therefore
/// x = exponentOf(closest) + factorOf(a) t^2. The values differ from kernelPhi by about 1e-6.
class FastKernel {
 public:
  __device__ explicit FastKernel(const KernelConstants<float>& k) : k_(k) {}

  [[nodiscard]] __device__ float exponentOf(float m) const {
    return kLog2E * m - kLog2E * k_.shift;
  }
  [[nodiscard]] __device__ static float factorOf(float a) { return kLog2E * a; }

  [[nodiscard]] __device__ bool isInside(float exponent) const {
    return exponent < exponentOf(k_.cutoff);
  }
  /// phi + base, also outside the support.
  [[nodiscard]] __device__ float quotient(float exponent) const {
    return k_.numerator * __fdividef(1.0f, k_.plateau + exp2f(exponent));
  }

 private:
  static constexpr float kLog2E = 1.44269504f;
  const KernelConstants<float>& k_;
};

/// Adds the lane's share of a pair's voxels to the sums.
template <class Sum>
__device__ void addPair(const PairForm& p, const KernelConstants<float>& kernel, Coord corner,
                        float units, Sum* sums) {
  const FastKernel fast(kernel);
  const float height = p.form.intensity * units, a = fast.factorOf(p.form.a);
  visitLines(p, corner, kernel.cutoff, int(threadIdx.x % kGroup), [&](const PairLine& line) {
    const float closest = fast.exponentOf(line.closest);
    float t = line.t;
    Sum* sum = sums + line.offset;
#pragma unroll 1  // an unrolled loop ends with different remainders on the lanes of a warp
    for (int n = line.count; n > 0; --n, t += 1.0f, sum += kBrickSide) {
      const float exponent = closest + a * t * t;
      const float phi = fast.quotient(exponent) - kernel.base;
      addUnits(*sum, fast.isInside(exponent) ? height * phi : 0.0f);
    }
  });
}

/// \return the residual of voxel v, r = V - target; V is clamped if the target saturates
__device__ inline float residualOf(const PassTarget& target, bool hasValues, std::size_t v,
                                   float sum) {
  const float t = hasValues ? target.values[v] : 0.0f;
  const float constant = hasValues && target.constants != nullptr ? target.constants[v] : 0.0f;
  const float r = sum + constant - t;
  return target.saturates ? fminf(fmaxf(r, target.lowest - t), target.highest - t) : r;
}

/// Replaces the sums by residuals. The order in which squares are added does not depend on the
/// number of threads.
template <class Sum, int kThreads>
__device__ void toResiduals(const PassTarget& target, const ResidualOutput& out,
                            std::uint32_t brick, float unit, Sum* sums) {
  __shared__ double parts[kBrickVoxels / kWarp];
  const std::size_t first = std::size_t(brick) * kBrickVoxels;
  for (int v = int(threadIdx.x); v < kBrickVoxels; v += kThreads) {
    Sum& sum = sums[paddedOffset(v)];
    const float r = residualOf(target, brick < target.bricks, first + v, float(sum) * unit);
    putValue(sum, r);
    if (out.residual != nullptr) out.residual[first + v] = r;
    const double squares = warpSum(double(r) * double(r));
    if (v % kWarp == 0) parts[v / kWarp] = squares;
  }
  __syncthreads();
  if (threadIdx.x != 0 || out.brickLoss == nullptr) return;
  double loss = 0.0;
  for (const double part : parts) loss += part;
  out.brickLoss[brick] = loss;
}

/// Computes the residuals of a brick in `sums`. A barrier must follow before a thread reads
/// residuals that another one wrote.
template <class Sum, int kThreads, class Kernels>
__device__ void sumBrick(const PassScene& scene, const Kernels& kernels, const PassTarget& target,
                         const ResidualOutput& out, const BlockBrick& brick, Sum* sums) {
  const auto ellipsoid = [&](std::uint32_t k) { return scene.lists.ellipsoid[k]; };
  const float unit = sumEntries<Sum, kThreads>(
      brick.entries, sums,
      [&](std::uint32_t k) { return scene.forms[ellipsoid(k)].form.intensity; },
      [&](std::uint32_t k, float units) {
        const std::uint32_t i = ellipsoid(k);
        const PairForm p = scene.forms[i];
        addPair(p, kernels.of(i), brick.corner, units, sums);
      });
  toResiduals<Sum, kThreads>(target, out, brick.number, unit, sums);
}

/// Computes the moments over the lane's share of a pair's voxels, in the order of PairMoments.
/// \param byValue  derivative of the loss by the value of each voxel
template <class Sum>
__device__ void sumMoments(const PairForm& p, const KernelConstants<float>& kernel, Coord corner,
                           const Sum* byValue, float (&s)[kMomentSlots]) {
  const FastKernel fast(kernel);
  const float a = fast.factorOf(p.form.a);
  visitLines(p, corner, kernel.cutoff, int(threadIdx.x % kGroup), [&](const PairLine& line) {
    const float closest = fast.exponentOf(line.closest);
    float w0 = 0.0f, w1 = 0.0f, t = line.t;
    const Sum* derivative = byValue + line.offset;
#pragma unroll 1  // remainders of an unrolled loop would differ here too, as in addPair
    for (int n = line.count; n > 0; --n, t += 1.0f, derivative += kBrickSide) {
      const float exponent = closest + a * t * t;
      const bool inside = fast.isInside(exponent);
      const float q = fast.quotient(exponent), phi = inside ? q - kernel.base : 0.0f;
      const float g = inside ? valueIn(*derivative) : 0.0f, gq = g * q;
      const float w = gq * (q * kernel.slope - 1.0f);  // g phi'
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

/// Sums kGroup values over the lanes of a group; lane n gets the sum of value n. Each exchange
/// halves the number of values that a lane holds.
__device__ inline float transposeSum(float* s) {
  const unsigned group = lanesOfGroup<kGroup>();
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

/// Writes the moments of one entry. All lanes of a group call it together.
template <class Kernels, class Sum>
__device__ void writeMoments(const PassScene& scene, const Kernels& kernels, std::uint32_t entry,
                             Coord corner, const Sum* byValue, float* moments) {
  const std::uint32_t i = scene.lists.ellipsoid[entry];
  const PairForm p = scene.forms[i];
  float s[kMomentSlots] = {};
  sumMoments(p, kernels.of(i), corner, byValue, s);
  float* const out = moments + std::size_t(scene.lists.pair[entry]) * kMoments;
#pragma unroll
  for (int first = 0; first < kMomentSlots; first += kGroup) {
    const float value = transposeSum(s + first);
    const int moment = first + int(threadIdx.x % kGroup);
    if (moment < kMoments) out[moment] = value;
  }
}

/// Writes the moments of all entries of a brick.
template <int kThreads, class Kernels, class Sum>
__device__ void writeAllMoments(const PassScene& scene, const Kernels& kernels,
                                const BlockBrick& brick, const Sum* byValue, float* moments) {
  visitEntries<kThreads>(brick.entries, [&](std::uint32_t k) {
    writeMoments(scene, kernels, k, brick.corner, byValue, moments);
  });
}

}  // namespace esvr::cuda
