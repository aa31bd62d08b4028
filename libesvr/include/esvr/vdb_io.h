#pragma once
/// OpenVDB (.vdb) and NanoVDB (.nvdb) files in and out. The format is told by the file's first
/// bytes when reading and by the extension when writing.

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "esvr/coord.h"
#include "esvr/grid_descriptor.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// A file's description of one of its grids.
struct GridSummary {
  std::string name;  ///< as stored; may be empty or shared by several grids
  std::string
      uniqueName;  ///< --grid takes it: the name, with "[i]" where several share it (i from 0)
  std::string valueType;  ///< OpenVDB's: "float", "double", "vec3s", "int32", "ptdataidx32", ...
  bool savedAsHalf = false;
  GridClass gridClass = GridClass::kUnknown;
  std::uint64_t activeVoxels = 0;
  Box activeBox;
  std::uint64_t storedBytes = 0;  ///< in the file; a grid that shares another's tree has few
  std::string skipReason;  ///< empty where the grid can be fitted; else why not, for the user
  bool isScalar = false;   ///< holds floats that readGrid takes, be the grid empty or not
};

struct VdbSummary {
  std::string format;  ///< "OpenVDB" or "NanoVDB"
  std::uint64_t fileBytes = 0;
  std::vector<MetaItem> metadata;  ///< file level, `creator` among it
  std::vector<GridSummary> grids;  ///< in file order
};

/// Lists a file's grids without reading their voxels where the format allows.
/// \throws BadInput  missing, a directory, empty, truncated, not a VDB (the text names the file)
[[nodiscard]] VdbSummary inspectVdb(const std::filesystem::path& path);

/// The treatment of NaN and infinite voxels.
enum class NonFinite { kRefuse, kZero };

struct ReadOptions {
  NonFinite nonFinite = NonFinite::kRefuse;
  bool allowEmpty = false;  ///< a grid without an active voxel is a volume without bricks
  /// Bound on the memory of the file's tree and of the bricks that are made from it. Active tiles
  /// become bricks; a tile may stand for 2^27 of them.
  std::uint64_t maxBytes = std::uint64_t{16} << 30;
};

/// A grid with its voxels.
struct VolumeGrid {
  GridDescriptor descriptor;
  SparseVolume volume;
  std::uint64_t nonFiniteReplaced = 0;  ///< voxels replaced under NonFinite::kZero
};

/// Reads one grid, its active tiles included. In the volume, active voxels hold the grid's values,
/// narrowed to float. Inactive voxels hold the background, whatever the file has there; in a level
/// set, the background with the sign that the file has, which tells inside from outside.
/// \param name  "density" (the first of that name), or "density[1]" for the second.
/// \throws BadInput  as inspectVdb; no such grid (lists those there are); a type that cannot be
/// fitted;
///                   no active voxel (without allowEmpty); non-finite voxels (first coordinate and
///                   count); MemoryExceeded: more than maxBytes
[[nodiscard]] VolumeGrid readGrid(const std::filesystem::path& path, const std::string& name,
                                  const ReadOptions& options = {});

enum class HalfMode { kAuto, kOn, kOff };  ///< kAuto: half where the source was saved as half

struct WriteOptions {
  HalfMode half = HalfMode::kAuto;
  bool overwrite = false;     ///< replace an existing file
  bool constantTiles = true;  ///< leaves that are active and constant throughout become tiles
};

/// Writes grids to .vdb (Blosc + active mask) or .nvdb, to a temporary file that is renamed when
/// complete. A level set gets its background as half width and a signed flood fill. Voxels that are
/// not active hold the background; leaves without active voxels are not written.
/// \param fileMetadata  verbatim; Blender reads a file as Y-up only if `creator` begins "Houdini"
/// \throws RuntimeFailure  exists (without overwrite), not writable, disk full; UsageError:
/// extension
void writeGrids(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                std::span<const VolumeGrid> grids, const WriteOptions& options = {});

/// The file-level metadata item in which writeGrids leaves its name, unless the source has one.
inline constexpr const char* kWriterKey = "esvr_writer";

/// A file-level metadata item of type "string".
[[nodiscard]] MetaItem stringItem(const std::string& name, const std::string& value);

/// A uniform-scale transform, as openvdb::math::Transform::createLinearTransform(voxelSize) makes
/// it.
[[nodiscard]] Transform uniformTransform(double voxelSize);

/// A transform from a row-vector affine 4x4, row major. \throws UsageError  singular
[[nodiscard]] Transform affineTransform(const std::array<double, 16>& matrix);

/// "OpenVDB 10.0.1, NanoVDB 32.4.2": the libraries compiled in, for --version.
[[nodiscard]] std::string vdbVersions();

}  // namespace esvr
