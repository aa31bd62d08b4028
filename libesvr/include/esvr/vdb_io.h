#pragma once
/// OpenVDB and NanoVDB: reads and writes their files, makes NanoVDB grids in memory, measures what their own
/// forms of a grid cost, and compares the surfaces of level sets.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "esvr/grid.h"
#include "esvr/volume.h"

namespace esvr {

namespace vdb {
struct ArchiveDirectory;
}

// Reads and writes OpenVDB (.vdb) and NanoVDB (.nvdb) files. A reader recognises the format by the
// file's first bytes; a writer chooses it by the extension.

/// Properties of one grid of a file.
struct GridSummary {
  std::string name;        ///< stored name; may be empty or shared by several grids
  std::string uniqueName;  ///< the name that --grid takes (GridNames::unique, grid.h)
  std::string valueType;   ///< OpenVDB's name: "float", "double", "vec3s", "ptdataidx32", ...
  bool savedAsHalf = false;
  GridClass gridClass = GridClass::kUnknown;
  std::uint64_t activeVoxels = 0;
  Box activeBox;
  std::uint64_t storedBytes = 0;  ///< bytes in the file; few if the grid shares another's tree
  std::string skipReason;  ///< reason, for the user, why readGrid's grid cannot be fitted; or empty
  /// Reason, for the user, why readCarried cannot read the grid; else empty.
  std::string whyNotCarried;
  bool isScalar = false;  ///< true if readGrid can read the value type, even of an empty grid
  /// True if readVector can read the grid: its values are of type "vec3s" or "vec3d" and it has an
  /// active voxel. A level set of vectors cannot be read.
  bool isVector = false;
  std::vector<MetaItem> metadata{};  ///< of the grid, as GridDescriptor::metadata (grid.h)
};

struct VdbSummary {
  std::string format;  ///< "OpenVDB" or "NanoVDB"
  std::uint64_t fileBytes = 0;
  std::vector<MetaItem> metadata;  ///< file-level metadata, which includes `creator`
  std::vector<GridSummary> grids;  ///< grids in file order
  /// Where the grids of a .vdb file are; see ReadOptions::directory.
  std::shared_ptr<const vdb::ArchiveDirectory> directory{};
};

/// Lists a file's grids. It does not read their voxels if the format allows this.
/// \throws BadInput  the file is missing, a directory, empty, truncated or not a VDB (the text
///                   names the file)
[[nodiscard]] VdbSummary inspectVdb(const std::filesystem::path& path);

/// Treatment of active voxels that are NaN, infinite or too large for float: they are an error, or they get a value or
/// the background of their grid (of a vector: of the component), or NaN and infinities stay what they are. In that case
/// only doubles that are finite but too large for float are an error.
enum class NonFinite { kRefuse, kValue, kBackground, kKeep };

struct ReadOptions {
  NonFinite nonFinite = NonFinite::kRefuse;
  float nonFiniteValue = 0.0f;  ///< the value of NonFinite::kValue, which is finite
  bool allowEmpty = false;      ///< a grid without active voxels becomes a volume without bricks
  /// Limit on the memory of the file's tree and of the bricks that are made from it. Active tiles
  /// become bricks; one tile may become 2^27 bricks.
  std::uint64_t maxBytes = std::uint64_t{16} << 30;
  /// Holds the voxels. Those in a file do not count towards maxBytes. Of the tree of a .vdb file,
  /// only the leaf that is being read has its voxels in memory.
  VoxelMemory memory{};
  /// Number of volumes of this size that the caller will have at the same time, with copies and codes
  /// that it makes. A grid is refused before it is read if the memory has no room for their masks, or
  /// the disk none for their voxels in files.
  std::uint64_t volumes = 1;
  /// VdbSummary::directory of the same file. Without it, each call looks at all grids of a file to find
  /// one, which is slow for all grids of a file with thousands. If the file has changed since, it is
  /// not used.
  std::shared_ptr<const vdb::ArchiveDirectory> directory{};
};

/// Reads one grid with its active tiles. Active voxels of the volume hold the grid's values,
/// rounded to float32. Inactive voxels hold the background and not the file's inactive values, which
/// VolumeGrid::inactive counts. In a level set they hold the background with the file's sign, which
/// distinguishes inside from outside.
/// \param place  index of the grid in VdbSummary::grids
/// \throws BadInput  as for inspectVdb; the file has no grid at this place; its type cannot be fitted;
///                   it has no active voxel (without allowEmpty); voxels are not finite (the text
///                   gives the first coordinate and the number)
/// \throws CannotConvert  a BadInput of a sound grid: its voxels are not finite (NotFinite) or 2^31
///                        apart, or its background is not a finite float
/// \throws MemoryExceeded  the grid needs more than maxBytes, or more than the disk of files has free;
///                         this is known from the tree, before tiles become bricks
[[nodiscard]] VolumeGrid readGrid(const std::filesystem::path& path, std::size_t place,
                                  const ReadOptions& options = {});

/// The same for a grid that a user has named (GridNames in grid.h): "density", "density[1]".
/// "vel.x" is read as a component of the vectors "vel" if no grid has this very name.
/// \throws BadInput, CannotConvert, MemoryExceeded  as above; no grid has the name, or several have it
///                                                  (the text lists the grids)
[[nodiscard]] VolumeGrid readGrid(const std::filesystem::path& path, const std::string& name,
                                  const ReadOptions& options = {});

/// Reads a component of a grid of vectors, as readGrid reads a grid of numbers. The
/// name of the result is componentName(). The component x has the metadata of the grid; the others
/// have none, so that a file with all of them holds the metadata once.
/// \param place      as for readGrid
/// \param component  0, 1 or 2
/// \throws BadInput  as for readGrid; the grid has not GridSummary::isVector
/// \throws MemoryExceeded  the component needs more than maxBytes
[[nodiscard]] VolumeGrid readComponent(const std::filesystem::path& path, std::size_t place,
                                       std::size_t component, const ReadOptions& options = {});
/// The same for a grid that a user has named. \throws  as above; as for readGrid by a name
[[nodiscard]] VolumeGrid readComponent(const std::filesystem::path& path, const std::string& name,
                                       std::size_t component, const ReadOptions& options = {});

/// Reads all components of a grid of vectors.
/// \throws BadInput  as for readComponent
/// \throws MemoryExceeded  the components together need more than maxBytes
[[nodiscard]] VectorGrid readVector(const std::filesystem::path& path, std::size_t place,
                                    const ReadOptions& options = {});
/// The same for a grid that a user has named. \throws  as above; as for readGrid by a name
[[nodiscard]] VectorGrid readVector(const std::filesystem::path& path, const std::string& name,
                                    const ReadOptions& options = {});

/// Reads the active voxels of a grid in their type: numbers of all kinds with all their bits, also if they
/// are not finite, vectors (those of type "vec3d" as floats), and the true voxels of a mask ("bool"). The
/// grid may have no active voxel. The sign of inactive voxels, which tells the inside of a level set from
/// the outside, is lost. A grid of a .nvdb file is read as readGrid reads it.
/// \param options  `maxBytes` is used; voxels are always in memory
/// \throws BadInput  as for inspectVdb; the file has no grid at this place; its type is another one
/// \throws MemoryExceeded  the grid needs more than maxBytes
[[nodiscard]] PackedGrid readPacked(const std::filesystem::path& path, std::size_t place,
                                    const ReadOptions& options = {});
/// The same for a grid, or a component, that a user has named. \throws  as above; as for readGrid by a name
[[nodiscard]] PackedGrid readPacked(const std::filesystem::path& path, const std::string& name,
                                    const ReadOptions& options = {});

/// Reads grids of a .vdb file as bytes. Their types may be unknown to OpenVDB, and their trees are
/// not checked.
/// \param places   indices of the grids in VdbSummary::grids
/// \param options  `maxBytes` is a limit on the bytes of all these grids; `memory` holds them
/// \throws BadInput  as for inspectVdb; a grid has GridSummary::whyNotCarried
/// \throws MemoryExceeded  the grids need more than maxBytes
[[nodiscard]] std::vector<CarriedGrid> readCarried(const std::filesystem::path& path,
                                                   std::span<const std::size_t> places,
                                                   const ReadOptions& options = {});

/// The properties of a carried grid, as inspectVdb finds them in the file that the grid comes from.
/// The unique name is the name.
/// \throws BadInput  the bytes are damaged
[[nodiscard]] GridSummary inspectCarried(const CarriedGrid& grid);

/// Reads the voxels of a carried grid of floats or doubles. \throws  as for readGrid
[[nodiscard]] VolumeGrid readGrid(const CarriedGrid& grid, const ReadOptions& options = {});

/// Reads the voxels of a carried grid of vectors. \throws  as for readVector
[[nodiscard]] VectorGrid readVector(const CarriedGrid& grid, const ReadOptions& options = {});

/// Reads the voxels of a carried grid of any type that readPacked takes. \throws  as for readPacked
[[nodiscard]] PackedGrid readPacked(const CarriedGrid& grid, const ReadOptions& options = {});

/// Choice of half floats for a written file; kAuto: half for ValueType::kHalf, unless a value is
/// beyond 65504, and for other grids whose metadata say half if half floats hold every value exactly.
/// The values of decodeGrid() are halfs if those of the source were, so that nothing is rounded here.
enum class HalfMode { kAuto, kOn, kOff };

struct WriteOptions {
  HalfMode half = HalfMode::kAuto;
  bool overwrite = false;  ///< replace an existing file
  /// Leaves whose voxels are all active and equal become tiles. If no leaf would remain, those
  /// of a small grid all remain, and one of a larger grid, because Blender draws nothing of a grid
  /// that has tiles only.
  bool constantTiles = true;
  /// Memory that the tree of a grid of a .vdb file may take, beside its voxels. Voxels far from each other take 0.3 MB each.
  std::uint64_t maxBytes = std::numeric_limits<std::uint64_t>::max();
};

/// Writes grids to a .vdb (with Blosc and active masks) or .nvdb file. The data go to a temporary
/// file, which is renamed when it is complete. The background of a level set is its half width, and
/// its inactive values are set by a signed flood fill. Inactive voxels hold the background; leaves
/// without active voxels are not written.
/// \param fileMetadata  metadata that are written verbatim; Blender reads a file as Y-up only if
///                      `creator` begins with "Houdini"
/// \throws RuntimeFailure  the file exists (without overwrite) or is not writable; the disk is full
/// \throws UsageError  the extension is neither .vdb nor .nvdb
void writeGrids(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                std::span<const VolumeGrid> grids, const WriteOptions& options = {});

/// A grid that is written: one of numbers or of vectors, one of any type whose active voxels are packed, or
/// one that is carried, whose bytes are written as they are. The grid must outlive this object.
using GridToWrite =
    std::variant<const VolumeGrid*, const CarriedGrid*, const VectorGrid*, const PackedGrid*>;

/// Writes grids of all kinds, in this order. A voxel of a grid of vectors is active if it is active
/// in any component.
/// \throws RuntimeFailure  as for writeGrids; a carried grid has a version of the VDB format that
///                         this version of OpenVDB does not write
/// \throws UsageError  as for writeGrids; the extension is .nvdb, and a grid has whyNotNano()
void writeGrids(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                std::span<const GridToWrite> grids, const WriteOptions& options = {});

/// The reason, for the user, why writeGrids cannot write a grid to a .nvdb file; else empty. NanoVDB's files
/// hold numbers and vectors of affine transforms, also those of carried grids that can be read (readGrid,
/// readVector), but no halfs.
[[nodiscard]] std::string whyNotNano(const GridToWrite& grid);

/// Name of the file-level metadata item that names the writer. writeGrids adds it if
/// `fileMetadata` has no item of this name.
inline constexpr const char* kWriterKey = "esvr_writer";

/// A file-level metadata item of type "string".
[[nodiscard]] MetaItem stringItem(const std::string& name, const std::string& value);
/// The text of an item of type "string"; empty if there is none.
[[nodiscard]] std::string stringValue(std::span<const MetaItem> items, const std::string& name);

/// A uniform-scale transform, as openvdb::math::Transform::createLinearTransform makes it.
[[nodiscard]] Transform uniformTransform(double voxelSize);

/// A transform from an affine 4x4 matrix for row vectors, in row-major order.
/// \throws UsageError  the matrix is singular
[[nodiscard]] Transform affineTransform(const std::array<double, 16>& matrix);

/// Versions of the libraries compiled in, for --version: "OpenVDB 10.0.1, NanoVDB 32.4.2".
[[nodiscard]] std::string vdbVersions();

// NanoVDB grids in memory, for the reference renderer (renderNano).

/// The value type of a NanoVDB grid. Quantised types have a range of values for each leaf; FpN also
/// has a number of bits for each leaf. The background within a leaf may have an error of half a
/// step, and is then drawn like any other value.
enum class NanoValues { kFloat, kFp4, kFp8, kFp16, kFpN };

/// A NanoVDB grid in the index space of the volume. Voxels outside its leaves are the background.
struct NanoVolume {
  NanoValues values = NanoValues::kFloat;
  std::shared_ptr<const std::byte[]> data;  ///< NanoVDB's grid buffer, aligned to 32 bytes
  std::size_t bytes = 0;
  float background = 0.0f;
  Box voxels;  ///< bounding box of the leaves; empty if there are none
};

/// Makes a NanoVDB grid without dithering. Level sets lose the sign of their inactive voxels.
/// \throws std::logic_error  the volume violates its invariants (checkInvariants)
[[nodiscard]] NanoVolume makeNanoVolume(const VolumeGrid& grid, NanoValues values);

// Writes a grid in every form of OpenVDB and NanoVDB files, as baselines for .esvr files. The
// files are written and read by the two libraries, and the times are measured. To write files for
// users, call writeGrids.

enum class PackedForm {
  kOpenVdbFloat,
  kOpenVdbHalf,
  kNanoFloat,
  kNanoFp16,  ///< 16 bits per voxel between the smallest and the largest value of a leaf
  kNanoFp8,
  kNanoFp4,
  kNanoFpN,  ///< the number of bits of a leaf follows from VoxelPacking::tolerance
};

enum class PackedCodec { kNone, kZip, kBlosc };

struct VoxelPacking {
  PackedForm form = PackedForm::kOpenVdbFloat;
  PackedCodec codec = PackedCodec::kBlosc;
  double tolerance = 0.0;  ///< largest error of a voxel for kNanoFpN, in value units; above 0
};

[[nodiscard]] bool isNanoVdb(PackedForm form);
/// The value type of a NanoVDB grid of this form; kFloat for OpenVDB's forms.
[[nodiscard]] NanoValues nanoValues(PackedForm form);

class VoxelPacker {
 public:
  /// Builds the OpenVDB grid that the files are written from. Constant leaves become tiles.
  explicit VoxelPacker(const VolumeGrid& grid);
  ~VoxelPacker();
  VoxelPacker(const VoxelPacker&) = delete;
  VoxelPacker& operator=(const VoxelPacker&) = delete;

  /// Writes a file and replaces an existing one. OpenVDB does not zip level sets and fog volumes;
  /// with kZip the class of such a grid is therefore written as unknown. OpenVDB files do not hold
  /// inactive values.
  /// \return seconds from OpenVDB's grid to the written file
  /// \throws UsageError  half floats cannot hold a value, NanoVDB cannot hold the transform, or the
  ///                     tolerance is missing
  /// \throws RuntimeFailure  the file is not writable
  double write(const std::filesystem::path& path, const VoxelPacking& packing) const;

 private:
  struct Source;
  std::unique_ptr<const Source> source_;
};

/// Seconds that the form's own library takes to read a file's grid into memory, as OpenVDB's tree
/// or NanoVDB's buffer.
/// \throws BadInput  the file is not of this form
[[nodiscard]] double secondsToRead(const std::filesystem::path& path, PackedForm form);

// The distance between the surfaces of two level sets.

/// A Hausdorff distance of two meshes, over their vertices.
struct MeshDistance {
  double voxels = 0.0;  ///< in voxels (index space)
  double world = 0.0;   ///< largest distance of the same pairs of points, in units of the world
};

/// Makes a mesh of each level set's zero crossing with openvdb::tools::volumeToMesh, at isovalue 0
/// and without adaptivity. For every vertex of either mesh, the nearest point of the other mesh is
/// sought; the result is the largest distance of such a pair, in both directions. The points are
/// sought on the polygons that are nearest to the 64 voxels around the vertex, so that the distance
/// is never too small; if these voxels are farther than 3 voxels from the mesh, on all polygons. Pairs are sought in index space. Their distance in the world is that after the
/// transform of the reference.
/// \return infinity if only one of the grids has a surface, and 0 if none has
[[nodiscard]] MeshDistance meshDistance(const VolumeGrid& reference, const VolumeGrid& candidate);

}  // namespace esvr
