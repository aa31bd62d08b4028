#include "generators/blobs.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "generators/hash_noise.h"
#include "generators/voxelise.h"

namespace esvr::samples {
namespace {

constexpr int kBlobs = 40;
constexpr double kSmallestRadius = 0.06, kLargestRadius = 0.22;  // in sides of the cube

double heightAt(const Blob& blob, Vec3 p) {
  const Vec3 d = p - blob.center;
  const double rest = 1.0 - dot(d, d) / (blob.radius * blob.radius);
  return rest > 0.0 ? blob.height * rest * rest * rest : 0.0;
}

std::vector<Blob> scatterBlobs(const SampleOptions& options) {
  Random random(options.seed);
  std::vector<Blob> blobs;
  for (int i = 0; i < kBlobs; ++i) {
    const double radius = random.uniform(kSmallestRadius, kLargestRadius);
    const Vec3 center = random.inCube(radius, 1.0 - radius);
    const double height = random.uniform(0.2, 1.0);
    // voxel centres lie at 0.5 / resolution, 1.5 / resolution, ...
    blobs.push_back({center * options.resolution - Vec3{0.5, 0.5, 0.5},
                     std::max(radius * options.resolution, 1.0), height});
  }
  return blobs;
}

}  // namespace

BlobShape::BlobShape(std::span<const Blob> blobs, float background)
    : blobs_(blobs), background_(background), near_(blobs.size()) {
  std::iota(near_.begin(), near_.end(), std::uint32_t{0});
}

std::optional<BlobShape> BlobShape::within(const Ball& ball) const {
  BlobShape narrowed(*this);
  std::erase_if(narrowed.near_, [&](std::uint32_t i) {
    return length(blobs_[i].center - ball.center) >= blobs_[i].radius + ball.radius;
  });
  if (narrowed.near_.empty()) return std::nullopt;
  return narrowed;
}

Sample BlobShape::at(Vec3 p) const {
  double sum = 0.0;
  for (const std::uint32_t i : near_) sum += heightAt(blobs_[i], p);
  if (sum < kFaintestBlob) return {background_, false};
  return {float(background_ + sum), true};
}

SparseVolume makeBlobs(const SampleOptions& options, float background) {
  const auto blobs = scatterBlobs(options);
  const int last = options.resolution;  // a blob of one voxel may reach beyond the cube
  return voxelise(BlobShape(blobs, background), {.box = {{-1, -1, -1}, {last, last, last}},
                                                 .background = background,
                                                 .maxBricks = options.limits.maxBricks,
                                                 .cancel = options.limits.cancel});
}

}  // namespace esvr::samples
