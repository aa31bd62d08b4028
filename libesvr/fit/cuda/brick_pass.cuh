#pragma once
/// Device functions of a pass over the bricks. They are templates, so that ellipsoids can share one
/// kernel or have their own.

#include "fit/cuda/brick_pass.h"
#include "fit/cuda/brick_sums.cuh"

namespace esvr::cuda {

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
