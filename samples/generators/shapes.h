#pragma once
/// Random numbers and noise that are the same on every machine. They use integer hashes and exact
/// float64 operations, but no distributions or transcendental functions of the standard library.
/// Samples that are given by a formula: diffuse blobs, a smoke plume, and a level set.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esvr/volume.h"
#include "generators/voxelise.h"

namespace esvr::samples {

/// Mixes all bits of a counter and a seed.
[[nodiscard]] std::uint64_t hash(std::uint64_t seed, std::uint64_t counter);

/// A stream of random numbers, of which the n-th is a hash of n.
class Random {
 public:
  explicit Random(std::uint64_t seed) : seed_(seed) {}

  [[nodiscard]] double uniform();  ///< the next number, uniform in [0, 1)
  [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * uniform(); }
  [[nodiscard]] Vec3 inCube(double low, double high);
  [[nodiscard]] Vec3 direction();  ///< uniform on the unit sphere

 private:
  std::uint64_t seed_, counter_ = 0;
};

/// Smooth noise with features of size 1, in [-1, 1].
[[nodiscard]] double noise(std::uint64_t seed, Vec3 p);

/// Largest slope of noise along an axis: its range times the largest slope of the fade, 15 / 8.
inline constexpr double kNoiseSlope = 2.0 * 15.0 / 8.0;

/// Sum of noise with features of sizes 1, 1/2, 1/4, ... and weights 1, 1/2, 1/4, ..., scaled to
/// [-1, 1].
[[nodiscard]] double fractalNoise(std::uint64_t seed, Vec3 p, int octaves);

// ---- Shapes

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
