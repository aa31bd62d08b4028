#include "convert/exact_voxels.h"

#include <limits>
#include <utility>

#include "core/add_seconds.h"
#include "esvr/grid_coding.h"
#include "format/voxel_section.h"

namespace esvr::convert {
namespace {

/// Factor by which an estimate may be too large.
constexpr double kEstimateMargin = 1.25;

constexpr double kExactPsnr = std::numeric_limits<double>::infinity();

/// The bytes of a sample's voxels, times the number of bricks for which each of its bricks stands.
/// The palette is there once.
double scaledBytes(const SparseVolume& volume, const SparseVolume& sample) {
  const VoxelLayer layer = exactLayer(sample);
  const double palette = double(layer.palette.size() * sizeof(float));
  const double share = double(sample.brickCount()) / double(volume.brickCount());
  return palette + (double(format::putVoxels(layer).size()) - palette) / share;
}

}  // namespace

bool isLarge(const Job& job) { return job.input.source.values.size() > job.limits.maxVoxels; }

Candidate estimateExactVoxels(const ConvertInput& input, const SampleSize& size) {
  double seconds = 0.0;
  const std::uint64_t bytes = addSeconds(seconds, [&] {
    const double voxels = scaledBytes(input.source, sampleOf(input.source, size));
    return std::uint64_t(voxels) + bytesBesideVoxels(input);
  });
  return {bytes, kExactPsnr, true, seconds};
}

ExactVoxels::ExactVoxels(const Job& job) : job_(job) {
  if (isLarge(job)) estimate_ = estimateExactVoxels(job.input, job.limits.sample);
}

const VoxelCandidate& ExactVoxels::coded() {
  if (!coded_) coded_ = exactVoxels(job_);
  return *coded_;
}

bool ExactVoxels::takeAtMost(double bytes) {
  const bool hopeless = !coded_ && estimate_ && double(estimate_->bytes) > kEstimateMargin * bytes;
  return !hopeless && double(coded().bytes) <= bytes;
}

Candidate ExactVoxels::figures() const {
  if (!coded_) return *estimate_;
  return {coded_->bytes, coded_->psnr, false, coded_->seconds};
}

VoxelCandidate ExactVoxels::take() && {
  (void)coded();
  return std::move(*coded_);
}

}  // namespace esvr::convert
