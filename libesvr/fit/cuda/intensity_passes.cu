// IntensityPasses on a GPU. Every pass computes phi again, which is faster there than reading it
// from memory.

#include <algorithm>
#include <string>

#include "core/cuda/device_buffer.h"
#include "core/cuda/reduce.cuh"
#include "core/cuda/runtime.h"
#include "esvr/error.h"
#include "field/brick_kernels.h"
#include "field/evaluate.h"
#include "field/voxel_rule.h"
#include "fit/cuda/brick_pass.cuh"
#include "fit/cuda/make_cuda.h"
#include "fit/cuda/step.h"

namespace esvr {
namespace cuda {
namespace {

// --- The kernels.

/// All pointers are to device memory that the caller owns.
struct IntensityPassArguments {
  /// Number of words for each brick in `exact`. Bit v is set if a reader gets voxel v exactly.
  static constexpr std::uint32_t kMaskWords = kBrickVoxels / 32;

  PassScene scene;       ///< the intensities of its forms are not used
  const float* heights;  ///< intensity of each ellipsoid
  KernelConstants<float> kernel;
  const float* source;  ///< kBrickVoxels values for each target brick
  float sourceBackground, fieldBackground;
  VoxelRule stored;
  Box box;                      ///< voxels whose errors count, in the bricks' frame
  StoredError* errors;          ///< output: error of each brick
  std::uint32_t* exact;         ///< kMaskWords words for each brick
  PairProjection* projections;  ///< output: projection of each pair
};

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

/// The sums of the projections of each ellipsoid's pairs, always in the same order.
struct ProjectionSums {
  const PairProjection* projections;
  const std::uint32_t* ellipsoidBegin;
  std::uint32_t ellipsoidCount;
  double *rPhi, *phi2;  ///< output: sums of each ellipsoid; null: not wanted
};

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

// --- The host's part.

/// The known bricks, in brick coordinates relative to their frame.
std::vector<Coord> bricksOf(const IntensityTarget& target) {
  std::vector<Coord> bricks = knownCorners(target);
  for (Coord& b : bricks) b = brickOf(b - target.source.origin);
  return bricks;
}

/// The source's values in the known bricks, in the order of the bricks.
std::vector<float> valuesOf(const IntensityTarget& target) {
  const auto corners = knownCorners(target);
  std::vector<float> all;
  all.reserve(corners.size() * kBrickVoxels);
  for (const Coord corner : corners) {
    const float* const values = sourceValues(target.source, corner);
    if (values != nullptr)
      all.insert(all.end(), values, values + kBrickVoxels);
    else
      all.insert(all.end(), std::size_t(kBrickVoxels), target.source.background);
  }
  return all;
}

void requireOneKappa(const Field& field) {
  for (const auto& chunk : field.chunks)
    if (!chunk.ellipsoids.kappa.empty())
      throw RuntimeFailure("solving for intensities on a GPU takes one kappa for all");
}

/// Kernels look at every brick of a support's bounding box, and number these bricks in 64 bits.
/// \param within  the box of bricks that there may be
/// \throws DeviceError  there are too many to look at
void requireCountable(std::span<const Ellipsoid> ellipsoids, double radius, const Box& within) {
  constexpr double kMaxLookedAt = 0x1p40;  // far more than the ellipsoids of a fit reach
  double bricks = 0.0;
  for (const Ellipsoid& e : ellipsoids)
    bricks +=
        common(brickRange(makeSupport(e.center, e.L, radius, kRoundingSlack)), within).volume();
  if (bricks > kMaxLookedAt)
    throw DeviceError("the ellipsoids reach up to " + std::to_string(bricks) +
                      " bricks, which are too many for a GPU; use the CPU");
}

class CudaIntensityPasses final : public IntensityPasses {
 public:
  /// The device must be the current one.
  explicit CudaIntensityPasses(const IntensityTarget& target);

  void setShapes(const Field& field) override;
  [[nodiscard]] StoredError error(std::span<const float> intensities) override;
  StoredError gradient(std::span<const float> intensities, IntensityGradient& out) override;
  void applyNormal(std::span<const double> direction, std::vector<double>& out) override;

 private:
  [[nodiscard]] IntensityPassArguments arguments(std::span<const float> heights);
  [[nodiscard]] StoredError totalError();
  void sumPairs(std::vector<double>* rPhi, std::vector<double>* phi2);

  Coord origin_;  ///< origin of the bricks' frame
  float sourceBackground_, fieldBackground_ = 0.0f;
  VoxelRule stored_;
  Box box_;
  bool restricted_;
  KernelConstants<float> kernel_{};
  std::size_t count_ = 0;  ///< number of ellipsoids
  KeepFreedMemory keep_;
  Stream stream_;
  BrickTable bricks_;
  PairLists lists_;
  DeviceBuffer<float> source_;
  GrowingBuffer<Ellipsoid> ellipsoids_;
  GrowingBuffer<PairForm> forms_;
  GrowingBuffer<float> heights_;
  GrowingBuffer<StoredError> errors_;
  GrowingBuffer<std::uint32_t> exact_;
  GrowingBuffer<PairProjection> projections_;
  GrowingBuffer<double> sums_;
  std::vector<StoredError> brickErrors_;
};

CudaIntensityPasses::CudaIntensityPasses(const IntensityTarget& target)
    : origin_(target.source.origin),
      sourceBackground_(target.source.background),
      stored_(target.rule),
      box_{target.box.min - origin_, target.box.max - origin_},
      restricted_(target.restrictToBricks),
      bricks_(bricksOf(target), stream_.get()),
      lists_(stream_.get()),
      source_(valuesOf(target), stream_.get()),
      ellipsoids_(stream_.get()),
      forms_(stream_.get()),
      heights_(stream_.get()),
      errors_(stream_.get()),
      exact_(stream_.get()),
      projections_(stream_.get()),
      sums_(stream_.get()) {}

void CudaIntensityPasses::setShapes(const Field& field) {
  requireOneKappa(field);
  const auto ellipsoids = importField(field, origin_, 1.0);
  const double radius = supportRadius(kernelConstants<double>(field.kernel));
  requireCountable(ellipsoids, radius, restricted_ ? bricks_.view().bounds : kAllBricks);
  fieldBackground_ = field.background;
  kernel_ = kernelConstants<float>(field.kernel);
  count_ = count32(ellipsoids.size(), "ellipsoids");
  uploadTo(ellipsoids_.reserve(count_), std::span<const Ellipsoid>(ellipsoids), stream_.get());
  launchForms({.ellipsoids = ellipsoids_.data(),
               .count = std::uint32_t(count_),
               .radius = radius,
               .forms = forms_.reserve(count_)},
              stream_.get());
  const SupportSource supports{ellipsoids_.data(), count_, radius, kRoundingSlack};
  if (!restricted_) bricks_.findReached(supports);
  lists_.rebuild(supports, bricks_);
  errors_.reserve(bricks_.size());
  exact_.reserve(bricks_.size() * IntensityPassArguments::kMaskWords);
  projections_.reserve(lists_.pairCount());
  sums_.reserve(2 * count_);
}

IntensityPassArguments CudaIntensityPasses::arguments(std::span<const float> heights) {
  uploadTo(heights_.reserve(count_), heights, stream_.get());
  return {.scene = passScene(bricks_, lists_, count_, forms_.data()),
          .heights = heights_.data(),
          .kernel = kernel_,
          .source = source_.data(),
          .sourceBackground = sourceBackground_,
          .fieldBackground = fieldBackground_,
          .stored = stored_,
          .box = box_,
          .errors = errors_.data(),
          .exact = exact_.data(),
          .projections = projections_.data()};
}

StoredError CudaIntensityPasses::totalError() {
  brickErrors_.resize(bricks_.size());
  downloadTo(std::span<StoredError>(brickErrors_), errors_.data(), stream_.get());
  StoredError total;
  for (const StoredError& e : brickErrors_) {
    total.squares += e.squares;
    total.largest = std::max(total.largest, e.largest);
  }
  return total;
}

void CudaIntensityPasses::sumPairs(std::vector<double>* rPhi, std::vector<double>* phi2) {
  double* const sums = sums_.data();
  if (count_ > 0) {
    const ProjectionSums all{.projections = projections_.data(),
                             .ellipsoidBegin = lists_.view().ellipsoidBegin,
                             .ellipsoidCount = std::uint32_t(count_),
                             .rPhi = sums,
                             .phi2 = phi2 ? sums + count_ : nullptr};
    sumProjections<<<blocksFor(count_ * kWarp, kBlock), kBlock, 0, stream_.get()>>>(all);
    check(cudaGetLastError(), "starting the sums of projections");
  }
  const auto download = [&](std::vector<double>* to, const double* from) {
    if (!to) return;
    to->resize(count_);
    downloadTo(std::span<double>(*to), from, stream_.get());
  };
  download(rPhi, sums);
  download(phi2, sums + count_);
}

StoredError CudaIntensityPasses::error(std::span<const float> intensities) {
  launch<Pass::kErrors>(arguments(intensities), stream_.get());
  return totalError();
}

StoredError CudaIntensityPasses::gradient(std::span<const float> intensities,
                                          IntensityGradient& out) {
  launch<Pass::kGradient>(arguments(intensities), stream_.get());
  sumPairs(&out.byIntensity, &out.curvature);
  return totalError();
}

void CudaIntensityPasses::applyNormal(std::span<const double> direction, std::vector<double>& out) {
  const std::vector<float> heights(direction.begin(), direction.end());
  launch<Pass::kNormal>(arguments(heights), stream_.get());
  sumPairs(&out, nullptr);
}

}  // namespace
}  // namespace cuda

std::unique_ptr<IntensityPasses> makeCudaIntensityPasses(const IntensityTarget& target,
                                                         const Device& device) {
  cuda::useDevice(device);
  return std::make_unique<cuda::CudaIntensityPasses>(target);
}

}  // namespace esvr
