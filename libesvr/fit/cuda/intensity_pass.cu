#include "fit/cuda/intensity_pass.h"

#include "core/cuda/check.h"
#include "core/cuda/thread_number.cuh"
#include "fit/cuda/brick_sums.cuh"

namespace esvr::cuda {
namespace {

constexpr int kWarpsOfBrick = kBrickVoxels / kWarp;

enum class Pass { kErrors, kGradient, kNormal };

/// Calls visit(offset, phi) for the lane's share of a pair's voxels. The offset is that in a padded
/// brick.
template <class Visit>
__device__ void visitVoxels(const IntensityPassArguments& a, std::uint32_t ellipsoid, Coord corner,
                            Visit&& visit) {
  const PairForm p = a.scene.forms[ellipsoid];
  visitLines(p, corner, a.kernel.cutoff, int(threadIdx.x % kGroup), [&](const PairLine& line) {
    float t = line.t;
    for (int n = line.count, at = line.offset; n > 0; --n, at += kBrickSide, t += 1.0f)
      visit(at, kernelPhi(a.kernel, squaredAt(p.form, line.closest, t)));
  });
}

/// Computes the sum of the ellipsoids over a brick in `sums`. \return the size of a unit
template <class Sum>
__device__ float sumBrick(const IntensityPassArguments& a, const BlockBrick& brick, Sum* sums) {
  const auto ellipsoid = [&](std::uint32_t k) { return a.scene.lists.ellipsoid[k]; };
  return sumEntries<Sum, kBlock>(
      brick.entries, sums, [&](std::uint32_t k) { return a.heights[ellipsoid(k)]; },
      [&](std::uint32_t k, float units) {
        const std::uint32_t i = ellipsoid(k);
        const float height = a.heights[i] * units;
        visitVoxels(a, i, brick.corner,
                    [&](int at, float phi) { addUnits(sums[at], height * phi); });
      });
}

/// Replaces the sums by floats, and sets voxels that were stored exactly to 0.
template <class Sum>
__device__ void clearExact(const IntensityPassArguments& a, std::uint32_t brick, float unit,
                           Sum* sums) {
  const std::uint32_t* const exact =
      a.exact + std::size_t(brick) * IntensityPassArguments::kMaskWords;
  for (int v = int(threadIdx.x); v < kBrickVoxels; v += kBlock) {
    Sum& sum = sums[paddedOffset(v)];
    const bool isExact = (exact[v / kWarp] >> (v % kWarp)) & 1u;
    putValue(sum, isExact ? 0.0f : float(sum) * unit);
  }
}

/// The errors of one voxel.
struct Missed {
  double stored;   ///< value that a reader gets, minus the source's
  float residual;  ///< sum minus the source's value; 0 if a reader gets the source's value
};
__device__ Missed missedAt(const IntensityPassArguments& a, std::uint32_t brick, int v, float sum) {
  const float wanted = brick < a.scene.targetCount ? a.source[std::size_t(brick) * kBrickVoxels + v]
                                                   : a.sourceBackground;
  const float value = a.fieldBackground + sum;
  const double stored = double(a.stored(value)) - double(wanted);
  return {stored, stored == 0.0 ? 0.0f : value - wanted};
}

/// Replaces the sums by residuals and computes the brick's error. Squares are always added in the
/// same order.
template <bool kMarksExact, class Sum>
__device__ void toErrors(const IntensityPassArguments& a, const BlockBrick& brick, float unit,
                         Sum* sums) {
  __shared__ double squares[kWarpsOfBrick], largest[kWarpsOfBrick];
  for (int v = int(threadIdx.x); v < kBrickVoxels; v += kBlock) {
    Sum& sum = sums[paddedOffset(v)];
    const int warp = v / kWarp;
    const Missed missed = missedAt(a, brick.number, v, float(sum) * unit);
    putValue(sum, missed.residual);
    const unsigned exact = __ballot_sync(kAllLanes, missed.stored == 0.0);
    const double counted = a.box.contains(brick.corner + voxelLocal(v)) ? missed.stored : 0.0;
    const double square = warpSum(counted * counted), peak = warpMax(fabs(counted));
    if (v % kWarp != 0) continue;
    squares[warp] = square, largest[warp] = peak;
    if (kMarksExact)
      a.exact[std::size_t(brick.number) * IntensityPassArguments::kMaskWords + std::size_t(warp)] =
          exact;
  }
  __syncthreads();
  if (threadIdx.x != 0) return;
  StoredError error;
  for (const double part : squares) error.squares += part;
  for (const double part : largest) error.largest = fmax(error.largest, part);
  a.errors[brick.number] = error;
}

template <class Sum>
__device__ void project(const IntensityPassArguments& a, const BlockBrick& brick,
                        const Sum* values) {
  visitEntries<kBlock>(brick.entries, [&](std::uint32_t k) {
    PairProjection sum{};
    visitVoxels(a, a.scene.lists.ellipsoid[k], brick.corner, [&](int at, float phi) {
      sum.rPhi += valueIn(values[at]) * phi;
      sum.phi2 += phi * phi;
    });
    const PairProjection all{groupSum<kGroup>(sum.rPhi), groupSum<kGroup>(sum.phi2)};
    if (threadIdx.x % kGroup == 0) a.projections[a.scene.lists.pair[k]] = all;
  });
}

/// Each block works on one brick, and each group of lanes on one pair at a time.
template <Pass kPass, class Sum>
__global__ void __launch_bounds__(kBlock) intensityPass(const IntensityPassArguments a) {
  __shared__ Sum sums[kPaddedVoxels];
  const BlockBrick brick = blockBrick(a.scene);
  if (!isFor<Sum>(brick.entries)) return;
  const float unit = sumBrick(a, brick, sums);
  if constexpr (kPass == Pass::kNormal)
    clearExact(a, brick.number, unit, sums);
  else
    toErrors<kPass == Pass::kGradient>(a, brick, unit, sums);
  if constexpr (kPass == Pass::kErrors) return;
  __syncthreads();
  project(a, brick, sums);
}

template <Pass kPass>
void launch(const IntensityPassArguments& a, cudaStream_t stream) {
  if (a.scene.brickCount == 0) return;
  if (const std::uint32_t wide = maxWideBricks(a.scene))
    intensityPass<kPass, WideSum><<<wide, kBlock, 0, stream>>>(a);
  intensityPass<kPass, NarrowSum><<<a.scene.brickCount, kBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting a pass of the solve for intensities");
}

/// Each warp sums the projections of one ellipsoid.
__global__ void sumProjections(const ProjectionSums s) {
  const std::size_t i = warpNumber();
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
