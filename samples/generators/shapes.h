#pragma once
/// Samples that are given by a formula: diffuse blobs, a smoke plume, and a level set.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esvr/volume.h"
#include "generators/voxelise.h"

namespace esvr::samples {

// Diffuse blobs: smooth densities without an edge.

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

// A noisy smoke plume.

/// Smoke that rises along y, widens and dissolves; it is `resolution` voxels high. The noise has
/// features down to a few voxels, so a finer plume has more detail. From frame to frame the eddies
/// rise, and change their shape, because the warp that forms them rises more slowly.
class PlumeShape {
 public:
  PlumeShape(std::uint64_t seed, int resolution, int frame = 0);

  [[nodiscard]] std::optional<PlumeShape> within(const Ball& ball) const;
  [[nodiscard]] Sample at(Vec3 voxel) const;

 private:
  // points p have a height of 0 to 1 along y; the axis is near x = z = 0
  [[nodiscard]] Vec3 place(Vec3 voxel) const;
  [[nodiscard]] double envelopeRadius(double y) const;
  [[nodiscard]] double distanceToAxis(Vec3 p) const;
  [[nodiscard]] Vec3 warped(Vec3 p) const;
  /// The place that noise has at p after all frames so far. \param rise  heights that it rises in a
  /// frame
  [[nodiscard]] Vec3 before(Vec3 p, double rise) const;
  [[nodiscard]] double densityAt(Vec3 p) const;

  std::uint64_t seed_;
  int resolution_, octaves_, frame_;
};

[[nodiscard]] SparseVolume makePlume(const SampleOptions& options);

// A level set: signed distances in a narrow band around a closed surface.

inline constexpr double kBandVoxels = 3.0;  ///< half width of the narrow band, OpenVDB's default

/// A ring and two balls that intersect it, about `resolution` voxels wide. Values are distances
/// times the voxel size, negative inside. Voxels within the band are active; others hold plus or
/// minus the background.
class LevelSetShape {
 public:
  LevelSetShape(int resolution, double voxelSize)
      : resolution_(resolution), voxelSize_(voxelSize) {}

  /// The signed distance in voxels. It is exact except deep inside, where parts overlap; there it
  /// is a lower bound of the depth.
  [[nodiscard]] double distance(Vec3 p) const;
  [[nodiscard]] std::optional<LevelSetShape> within(const Ball& ball) const;
  [[nodiscard]] Sample at(Vec3 p) const;

 private:
  int resolution_;
  double voxelSize_;
};

/// The background is the band's half width.
[[nodiscard]] SparseVolume makeLevelSet(const SampleOptions& options, double voxelSize);

}  // namespace esvr::samples
