#pragma once
/// Diffuse blobs: smooth densities without an edge.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esvr/sparse_volume.h"
#include "generators/sample_options.h"
#include "generators/voxelise.h"

namespace esvr::samples {

/// A blob in index coordinates: height * (1 - (distance / radius)^2)^3, of which two derivatives
/// vanish at the rim.
struct Blob {
  Vec3 center;
  double radius = 0.0, height = 0.0;
};

/// A background plus a sum of blobs; points where the sum is below kFaintestBlob are empty.
class BlobShape {
 public:
  /// \param blobs  blobs that outlive all shapes narrowed from this one
  BlobShape(std::span<const Blob> blobs, float background);

  [[nodiscard]] std::optional<BlobShape> within(const Ball& ball) const;
  [[nodiscard]] Sample at(Vec3 p) const;

 private:
  std::span<const Blob> blobs_;
  float background_;
  std::vector<std::uint32_t> near_;  ///< the blobs that reach where this shape is used
};
inline constexpr double kFaintestBlob = 1.0 / 1024.0;

/// Overlapping blobs in a cube of `resolution` voxels.
[[nodiscard]] SparseVolume makeBlobs(const SampleOptions& options, float background = 0.0f);

}  // namespace esvr::samples
