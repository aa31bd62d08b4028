#include "fit/cuda/cuda_intensity_passes.h"

#include <algorithm>
#include <string>

#include "core/cuda/copy.h"
#include "core/cuda/count32.h"
#include "core/cuda/use_device.h"
#include "esvr/error.h"
#include "field/gather.h"
#include "fit/cuda/make_cuda_intensity_passes.h"
#include "fit/cuda/step.h"
#include "fit/import_field.h"

namespace esvr {
namespace cuda {
namespace {

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

}  // namespace

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
  launchProjectionSums({.projections = projections_.data(),
                        .ellipsoidBegin = lists_.view().ellipsoidBegin,
                        .ellipsoidCount = std::uint32_t(count_),
                        .rPhi = sums,
                        .phi2 = phi2 ? sums + count_ : nullptr},
                       stream_.get());
  const auto download = [&](std::vector<double>* to, const double* from) {
    if (!to) return;
    to->resize(count_);
    downloadTo(std::span<double>(*to), from, stream_.get());
  };
  download(rPhi, sums);
  download(phi2, sums + count_);
}

StoredError CudaIntensityPasses::error(std::span<const float> intensities) {
  launchStoredErrors(arguments(intensities), stream_.get());
  return totalError();
}

StoredError CudaIntensityPasses::gradient(std::span<const float> intensities,
                                          IntensityGradient& out) {
  launchIntensityGradient(arguments(intensities), stream_.get());
  sumPairs(&out.byIntensity, &out.curvature);
  return totalError();
}

void CudaIntensityPasses::applyNormal(std::span<const double> direction, std::vector<double>& out) {
  const std::vector<float> heights(direction.begin(), direction.end());
  launchNormalProduct(arguments(heights), stream_.get());
  sumPairs(&out, nullptr);
}

}  // namespace cuda

std::unique_ptr<IntensityPasses> makeCudaIntensityPasses(const IntensityTarget& target,
                                                         const Device& device) {
  cuda::useDevice(device);
  return std::make_unique<cuda::CudaIntensityPasses>(target);
}

}  // namespace esvr
