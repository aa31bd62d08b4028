#pragma once
/// 3D Gaussian splats: made from the ellipsoids of a grid, written and read as files, and turned into grids of
/// a density. docs/splats.md derives the mapping and states its errors.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/grid.h"
#include "esvr/transfer_function.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"

namespace esvr {

/// n splats as a structure of arrays. On a ray at the distance d from its center, measured in standard
/// deviations, splat i hides the share alpha[i] exp(-d^2 / 2) of what lies behind it.
struct Splats {
  std::array<std::vector<float>, 3> center;    ///< x, y, z in the space of the file
  std::array<std::vector<float>, 3> logScale;  ///< natural logarithms of the standard deviations
  std::array<std::vector<float>, 4> rotation;  ///< unit quaternion w, x, y, z with w >= 0
  std::vector<float> alpha;                    ///< above 0 and at most 1
  std::array<std::vector<float>, 3>
      color;  ///< red, green, blue, usually 0 to 1; empty: there are none

  [[nodiscard]] std::size_t size() const { return alpha.size(); }
  [[nodiscard]] bool hasColors() const { return !color[0].empty(); }
  void resize(std::size_t n, bool withColors);
};

/// The axis of the world that points upwards.
enum class UpAxis { kY, kZ };

/// Splats and where they are in the world.
struct SplatScene {
  Splats splats;
  std::string name;  ///< of the grid; a name for the prim of a USD file
  /// Affine 4x4 matrix for row vectors, row-major, from the space of the file to the world (world =
  /// [x y z 1] * M), as Transform::affine. It turns, scales alike along all axes, and shifts.
  std::array<double, 16> toWorld{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  UpAxis up = UpAxis::kY;  ///< of the world
  /// The extinction of a length of one unit of the world, for a density of 1.
  double densityScale = 1.0;
  /// Of the grid from whose ellipsoids makeSplats() made the splats: the map from its index space to the world, as
  /// Transform::affine. Their sizes then grew with their depth, which makeSplatGrids() undoes. Nothing for voxels that are
  /// so small or flat that OpenVDB makes no transform of them.
  std::optional<std::array<double, 16>> indexToWorld{};
};

// Files.

/// The forms of files. The space of the file differs.
enum class SplatForm {
  /// PLY as viewers and trainers of splats have it: y down, z forward, centered, the longest side of the box 10
  /// units long, so that all formats that are made from it keep the places.
  kPly,
  kMitsuba,  ///< PLY for the shape `ellipsoids` of Mitsuba 3, in the world
  kUsd  ///< text of USD: a prim ParticleField3DGaussianSplat, centered, with a transform to the world
};

/// Writes the whole file or nothing.
/// \throws CannotConvert  readSplats() would refuse the PLY file, or leave splats out: the density scale or a matrix is
///                        not between 1e-30 and 1e30, or a size not between e^-32 and e^32
/// \throws RuntimeFailure  the file exists (without `overwrite`) or is not writable; the disk is full
void writeSplats(const std::filesystem::path& path, const SplatScene& scene, SplatForm form,
                 bool overwrite = false);

struct SplatReadOptions {
  std::uint64_t maxBytes = kNoMemoryLimit;  ///< limit on the memory of the splats
  /// The axis of the world that is up, for a file that does not say where its splats are in the world. Such
  /// a file is taken to have y down and z forward. Nothing: its axes are those of the world.
  std::optional<UpAxis> up = UpAxis::kY;
};

/// Why a splat is left out. A size is the largest of its three standard deviations.
enum class SplatFault { kNotFinite, kNoRotation, kTooSmall, kTooLarge, kUnseen };
inline constexpr std::size_t kSplatFaults = 5;

struct SplatFile {
  SplatScene scene;
  std::uint64_t inFile = 0;  ///< splats in the file
  /// Those that were left out, by their SplatFault.
  std::array<std::uint64_t, kSplatFaults> faulty{};
  /// The number of all that were left out.
  [[nodiscard]] std::uint64_t dropped() const;
  /// Why they were left out: "3 with a quaternion of 0, 1 with an opacity of 0".
  [[nodiscard]] std::string whyDropped() const;
  std::uint64_t rounded = 0;      ///< those with a smallest size that was raised (kMostFlat)
  bool hasPlacement = false;      ///< the file says where its splats are in the world
  bool hasHigherDegrees = false;  ///< colors that depend on the direction were ignored
};

/// The largest size of a splat divided by its smallest one. Flatter splats are made as thick.
inline constexpr double kMostFlat = 1000.0;

/// Reads a PLY file of splats: ASCII or binary of both byte orders, with numbers of any type in any order, and
/// other elements and lists beside them. The first element `vertex` has the properties x, y, z, opacity (a
/// logit), scale_0 to scale_2 (logarithms), rot_0 to rot_3 (w, x, y, z) and, with colors, f_dc_0 to f_dc_2.
/// \throws BadInput  the file is missing, no PLY file, damaged or shorter than it says; a property is missing;
///                   no splat is left
/// \throws MemoryExceeded  the splats need more than maxBytes
[[nodiscard]] SplatFile readSplats(const std::filesystem::path& path,
                                   const SplatReadOptions& options = {});

/// The same for bytes in memory. \param nameForErrors  name of the file in error texts
[[nodiscard]] SplatFile parseSplats(std::span<const std::byte> bytes,
                                    const std::string& nameForErrors,
                                    const SplatReadOptions& options = {});

// From ellipsoids to splats.

struct SplatOptions {
  SplatForm form = SplatForm::kPly;
  /// The axis of the world that points upwards, and to -y of a file of the form kPly. Nothing: the axes of the
  /// file are those of the world.
  std::optional<UpAxis> up = UpAxis::kY;
  ColorMap colors;  ///< over the values of the grid
  /// The extinction of a length of one unit of the world for a value of 1. Default: that with which the median
  /// column of the grid lets half of the light through (medianDepth, metrics.h), or, without such a column,
  /// that with which the largest value hides all but 1/1000 behind the longest side of the box.
  std::optional<double> densityScale{};
  std::uint64_t maxBytes = kNoMemoryLimit;  ///< limit on the memory of the evaluation
};

struct MadeSplats {
  SplatScene scene;
  std::uint64_t ellipsoids = 0;  ///< of the grid
  std::uint64_t negative =
      0;  ///< ellipsoids without a splat, because they take away from the others
  /// The share of the optical depth that is left out, because it is in splats with an alpha below 1/510.
  double faintShare = 0.0;
  std::uint64_t clamped = 0;  ///< splats whose size is at a limit of the formats
};

/// Makes splats from the ellipsoids of a grid.
/// \throws UsageError  the colors have no points; the density scale is not above 0
/// \throws CannotConvert  the grid holds voxels or a level set, has a background other than 0, no ellipsoid or
///                        no affine transform; the text names the way out
/// \throws MemoryExceeded  the evaluation of its sum needs more than maxBytes; nothing was evaluated
[[nodiscard]] MadeSplats makeSplats(const StoredGrid& grid, const SplatOptions& options);

// From splats to grids.

struct SplatGridOptions {
  /// The shortest edge of a voxel in the world, above 0. Default: that of SplatScene::indexToWorld, or else 1/256 of
  /// the longest side of the box of the centers, of which 1 % at each end of every axis does not count. Where there is
  /// such a map, voxels of any size are on its lattice (transformAt in esvr/resolution.h).
  std::optional<double> voxelSize{};
  std::optional<double> densityScale{};  ///< default: SplatScene::densityScale
  std::uint64_t maxBytes =
      kNoMemoryLimit;    ///< limit on the memory of the evaluation and its result
  VoxelMemory memory{};  ///< holds the voxels
};

struct SplatGrids {
  VolumeGrid density;  ///< a fog volume
  std::optional<VectorGrid>
      color;  ///< "Cd", the mean color of the splats at a voxel, weighted by their density
  double voxelSize = 0.0;  ///< the shortest edge
  std::uint64_t thickened =
      0;  ///< splats thinner than voxels, which were made kThinnest voxels thick
};

/// The smallest standard deviation of a splat that voxels hold, in voxels: the sum of its values at voxels then
/// has an error of at most 0.2 %.
inline constexpr double kThinnest = 0.6;

/// Evaluates the density of splats at voxels: a sum of Gaussians whose extinction is that of the splats, summed
/// over a picture and averaged over all directions. A voxel is active if its side has an optical depth of more
/// than 1e-5.
/// \throws UsageError  the voxel size or the density scale is not above 0
/// \throws BadInput    a splat is wider than the index space has voxels; no voxel is active
/// \throws MemoryExceeded  the grids need more than maxBytes; nothing was evaluated
[[nodiscard]] SplatGrids makeSplatGrids(const SplatScene& scene,
                                        const SplatGridOptions& options = {});

}  // namespace esvr
