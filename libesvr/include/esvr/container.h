#pragma once
/// Reads, writes and inspects .esvr files. docs/format.md specifies every byte.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "esvr/grid.h"
#include "esvr/quantised.h"
#include "esvr/tone.h"
#include "esvr/volume.h"

namespace esvr {

inline constexpr std::uint16_t kFormatVersion = 1;
inline constexpr std::uint64_t kSectionRowBytes = 56;  ///< a row of a file's section table

/// The rule that determines the active voxels when a grid is revoxelised. No voxel outside
/// StoredGrid::activeBox is active, and StoredGrid::boxVoxels are.
enum class TopologyKind {
  kThreshold = 0,  ///< a voxel is active if |V - background| > activeThreshold
  /// The rule of kThreshold, within the stored bricks only. If the grid is a narrow band, a voxel
  /// of these bricks is active if |V| < background - activeThreshold.
  kBricks = 1,
  kMask = 2  ///< the voxels of `mask` are active, whatever their values
};

/// The error of the first k importance layers of every chunk against the source. A grid has a row
/// for each k.
struct LayerError {
  float psnrBox = 0.0f;   ///< dB over the box of the conversion; infinite if there is no error
  float maxError = 0.0f;  ///< largest absolute error
  friend bool operator==(const LayerError&, const LayerError&) = default;
};

/// The grid whose voxels are the context of another grid's voxels in a file (docs/format.md, "Related
/// voxels"). A value v of it is expected to be about gain * v + offset in the other grid.
struct VoxelReference {
  /// Index in EsvrFile::grids, below that of the grid that has the reference. Nothing: the context
  /// is empty. The coding is nevertheless another one than without a reference.
  std::optional<std::size_t> grid{};
  float gain = 1.0f, offset = 0.0f;
  friend bool operator==(const VoxelReference&, const VoxelReference&) = default;
};

/// Numbers of voxels that are NaN or infinite.
struct NonFiniteCounts {
  std::uint64_t nan = 0, plusInfinity = 0, minusInfinity = 0;

  [[nodiscard]] std::uint64_t total() const { return nan + plusInfinity + minusInfinity; }
  friend bool operator==(const NonFiniteCounts&, const NonFiniteCounts&) = default;
};

/// One grid of a file.
struct StoredGrid {
  GridDescriptor descriptor;
  Field field;
  TopologyKind topology = TopologyKind::kThreshold;
  float activeThreshold = 0.0f;  ///< threshold of the topology; negative: all voxels are active
  /// Index corners of the bricks that may have active voxels, increasing; empty for kThreshold.
  std::vector<Coord> bricks;
  std::vector<BrickMask> mask;  ///< active voxels of each brick, for kMask; else empty
  /// The background of the source is far from its values (spanOf, volume.h). The background of
  /// `field` and of `voxels` then is a value among the active ones, to which these are relative, and
  /// decoded inactive voxels get the background of `descriptor`. Only with kMask or with voxels.
  bool farBackground = false;
  /// The sum of ellipsoids and quantised voxels are tones, which decodeGrid() turns into values; exact
  /// voxels are values, as are all other members. Only with a background of 0, with `withinRange`, and
  /// without a far background or a residual.
  ToneCurve tone;
  bool withinRange = true;  ///< decoded values are clamped to the source's range of values
  Box activeBox;            ///< active bounding box of the source, index coordinates
  /// Voxels of `activeBox` that are active whatever their values, so that its faces keep an active voxel;
  /// at most kMostBoxVoxels, increasing; empty for kMask and for voxels.
  std::vector<Coord> boxVoxels;
  std::uint64_t activeVoxels = 0;          ///< number of active voxels of the source
  float valueMin = 0.0f, valueMax = 0.0f;  ///< range of the source's active voxels
  std::vector<CurvePoint> curve;
  /// The quantised ellipsoids of every chunk. The ellipsoids of `field` are exactly their
  /// dequantised form. If this is empty, the ellipsoids are stored as float32.
  std::vector<QuantisedEllipsoids> quantised;
  std::vector<LayerError> layerErrors;  ///< empty, or layerCount() rows
  /// Correction that is added to the sum, voxel by voxel, before the active voxels are determined.
  /// Its form is VoxelForm::kQuantised with all voxels active; it is 0 in other bricks. A grid
  /// cannot have both `residual` and `voxels`.
  std::optional<VoxelLayer> residual;
  /// The voxels themselves, exact or within a bound. If present, decodeGrid() returns them.
  std::optional<VoxelLayer> voxels;
  /// How the voxels are coded. A reader gets the same voxels with and without it.
  std::optional<VoxelReference> reference;
  /// Active voxels of the source that are NaN or infinite (NonFinite::kKeep, vdb_io.h). The sum of ellipsoids and
  /// `voxels` have finite values there, which decodeGrid() replaces; `valueMin` and `valueMax` are those of the
  /// other voxels.
  NonFiniteCounts nonFinite;
  /// Where they are: a layer of kPalette in which only they are active, and all others vacant. Its palette has 0 for
  /// the vacant ones, and 1 for NaN, 2 for plus and 3 for minus infinity, as far as there are any. There if
  /// `nonFinite` counts any, except in a grid of which a part of a file has the record only.
  std::optional<VoxelLayer> nonFiniteVoxels;
};

/// Why float32 evaluates the sum of a grid's ellipsoids with an error above 1e-4 of its largest value; empty if it does
/// not. Fits with the default options make no such grid (docs/figures/stability.md).
[[nodiscard]] std::string whyImprecise(const StoredGrid& grid);

/// Bytes of each stream of a grid's quantised ellipsoids.
struct StreamBytes {
  std::uint64_t positions = 0, scales = 0, rotations = 0, intensities = 0;
};
[[nodiscard]] StreamBytes streamBytes(const StoredGrid& grid);

/// Number of importance layers of a grid, which is the largest number of layers of a chunk. It is 1
/// if no chunk has several layers, and 0 without ellipsoids.
[[nodiscard]] std::size_t layerCount(const StoredGrid& grid);

/// Ellipsoids and bytes of one importance layer, over all chunks.
struct LayerSize {
  std::uint64_t ellipsoids = 0, bytes = 0;
};
/// The sizes of the layers of a grid; empty if its ellipsoids are not quantised.
[[nodiscard]] std::vector<LayerSize> layerSizes(const StoredGrid& grid);

/// A grid of vectors, whose components are the grids `first`, `first` + 1 and `first` + 2 of
/// EsvrFile::grids. They agree in class, value type and transform. Component x has the metadata.
struct StoredVector {
  std::string name;       ///< name in the source; not necessarily unique
  std::size_t first = 0;  ///< index of component x
  friend bool operator==(const StoredVector&, const StoredVector&) = default;
};

/// How the sections of a file are arranged. Readers get the same grids from both.
enum class FileLayout {
  kPlain,   ///< each section has a row of the section table
  kCompact  ///< grid records are compressed together, and small sections share a row
};

struct EsvrFile {
  std::vector<MetaItem> metadata;  ///< the source's file-level metadata, verbatim
  std::vector<StoredGrid> grids;   ///< grids that were converted, in their order
  /// Grids that were not converted, by increasing places. Those of a file that was read without
  /// ReadLimits::carriedBytes have no bytes, and cannot be written.
  std::vector<CarriedGrid> carried{};
  /// Grids of vectors, by increasing indices of their components. No two share a component.
  std::vector<StoredVector> vectors{};
  FileLayout layout = FileLayout::kPlain;
};

using StoredComponents = std::span<const StoredGrid, kComponents>;
/// The components of a grid of vectors of a file.
[[nodiscard]] StoredComponents componentsOf(const EsvrFile& file, const StoredVector& vector);

/// One of all grids of a file.
struct GridOfFile {
  bool isCarried = false;  ///< whether it is one of EsvrFile::carried
  std::size_t index = 0;   ///< index in that list, in EsvrFile::vectors or in EsvrFile::grids
  bool isVector = false;   ///< whether it is one of EsvrFile::vectors
  friend bool operator==(const GridOfFile&, const GridOfFile&) = default;
};

/// All grids in the order of the file: carried grids have their places, and the others are between
/// them in their order. A grid of vectors stands for its components, which count as three grids in
/// the places.
/// \throws RuntimeFailure  the places do not increase, or one is not below the number of grids; a
///                         carried grid is between components of a vector; a vector has not three
///                         components of its own
[[nodiscard]] std::vector<GridOfFile> gridsInOrder(const EsvrFile& file);

/// The name of a grid in the source.
[[nodiscard]] const std::string& nameOf(const EsvrFile& file, const GridOfFile& grid);

/// The names of all grids in the order of the file.
[[nodiscard]] std::vector<std::string> namesInOrder(const EsvrFile& file);

/// The names by which users find each of EsvrFile::grids: GridNames::unique (grid.h), and for
/// components of vectors GridNames::ofComponent. They are the same as in the .vdb file that the file comes
/// from, if it has all grids of it.
[[nodiscard]] std::vector<std::string> namesOfStored(const EsvrFile& file);

/// The index in EsvrFile::grids of the grid of numbers or the component that a user names (GridNames).
/// \param path  file name for the error's text; empty if the caller adds it
/// \throws BadInput  there is no such grid, or its name is ambiguous (the text lists grids); the grid is
///                   carried or has vectors, of which one component is to be named
[[nodiscard]] std::size_t findStored(const EsvrFile& file, const std::string& wanted,
                                     const std::filesystem::path& path = {});

struct ContainerWriteOptions {
  bool overwrite = false;
};

/// Writes a file. The data go to a temporary file in the folder of `path`, which is flushed and
/// then renamed.
/// \return the number of bytes written
/// \throws RuntimeFailure  the file exists (without overwrite) or is not writable; the disk is full
///                         or the limit of a file's size is reached (if SIGXFSZ is ignored).
///                         Other cases are those of encodeEsvr
std::uint64_t writeEsvr(const std::filesystem::path& path, const EsvrFile& file,
                        const ContainerWriteOptions& options = {});

/// Limits of reading. The content of a small file may need much more memory than the file has
/// bytes, because sections are compressed, equal ellipsoids or voxels take hardly any bytes, and
/// several grids may share their bytes.
struct ReadLimits {
  std::uint64_t maxBytes = kNoMemoryLimit;
  /// Holds voxels and the bytes of carried grids; those in a file do not count towards maxBytes.
  VoxelMemory memory{};
  bool carriedBytes = true;  ///< false: the bytes of carried grids are checked, but not kept
};

/// Bytes of the heap that the content of a file takes: ellipsoids, voxels and carried grids. Voxels in
/// files do not count.
[[nodiscard]] std::uint64_t contentBytes(const EsvrFile& file);

/// Reads a whole file. Every size is checked before memory is allocated, every section is checked
/// against its checksum, and every parameter must be finite.
/// \throws BadInput  the file is missing, not an .esvr file, of a newer major version, truncated or
///                   damaged (the text says where); it holds a sequence (sequence_file.h)
/// \throws MemoryExceeded  the content needs more memory than the limits allow
[[nodiscard]] EsvrFile readEsvr(const std::filesystem::path& path, const ReadLimits& limits = {});

/// Selects a part of a file. A reader finds the part by the section table, the chunk records and
/// the directories of blocks. A grid that is stored as voxels is read completely.
struct ReadPart {
  /// Selects every ellipsoid whose support meets the box; the result may contain others.
  std::optional<Box> box{};
  std::optional<std::size_t> layers{};  ///< largest number of importance layers, from the first
  /// Selects the smallest number of these layers that hold at least this many ellipsoids together.
  std::optional<std::size_t> ellipsoids{};
  /// Indices in EsvrFile::grids of the grids that are wanted. These and the grids that they refer to
  /// are read; of other grids, everything but their ellipsoids, voxels and masks is read. Nothing:
  /// all grids are wanted.
  std::optional<std::vector<std::size_t>> grids{};
  bool carriedBytes = false;  ///< whether the bytes of carried grids are read, too
  ReadLimits limits{};        ///< ReadLimits::carriedBytes has no effect
};

struct PartOfFile {
  EsvrFile file;  ///< the part that was read, as a file; it has layer errors only without a box
  /// For each of `file.grids`, the number of its ellipsoids in the file, whether they were read or not.
  std::vector<std::uint64_t> ellipsoidsInFile;
  std::uint64_t bytesRead = 0;
};

/// Reads a part of a file. The rest of the file is not checked.
/// \throws BadInput, MemoryExceeded  as for readEsvr
[[nodiscard]] PartOfFile readEsvrPart(const std::filesystem::path& path, const ReadPart& part);

/// Largest number of bytes that a grid adds to a file: its sections, their padding, and its rows of
/// the section table. A file is at most as large as bytesBesideGrids() plus the sum of bytesAdded()
/// over its grids. It is smaller where sections are the same, because they are stored once.
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] std::uint64_t bytesAdded(const StoredGrid& grid);

/// The same for a grid of a file, which may refer to grids before it.
[[nodiscard]] std::uint64_t bytesAdded(const EsvrFile& file, std::size_t grid);

/// Largest number of bytes that several grids add to a file together. Sections that several of them
/// have count once.
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] std::uint64_t bytesAddedTogether(std::vector<StoredGrid> grids);

/// Largest number of bytes that carried grids add to a file, with their rows of the section table.
/// Their places do not matter.
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] std::uint64_t bytesOfCarried(const std::vector<CarriedGrid>& grids);

/// Largest number of bytes that grids of vectors add to a file besides their components.
[[nodiscard]] std::uint64_t bytesOfVectors(const std::vector<StoredVector>& vectors);

/// Bytes of a file without grids, including the padding before the first grid.
[[nodiscard]] std::uint64_t bytesBesideGrids(const std::vector<MetaItem>& metadata);

/// Encodes a file in memory. The same content gives the same bytes. Sections of the same kind and
/// content are stored once. The ellipsoids of a chunk are stored in Morton order of their centers;
/// a reader gets them in that order, bit for bit.
/// \throws RuntimeFailure  the content is invalid: a number is not finite, a quaternion has no unit
///                         length, the bricks' corners are not increasing, the places of carried
///                         grids or the vectors are not those of gridsInOrder, a carried grid has
///                         no bytes, or components differ in class, value type or transform
[[nodiscard]] std::vector<std::byte> encodeEsvr(const EsvrFile& file);
/// Decodes a file in memory.
/// \param nameForErrors  name of the file in error texts
/// \throws BadInput  as for readEsvr
[[nodiscard]] EsvrFile decodeEsvr(std::span<const std::byte> bytes,
                                  const std::string& nameForErrors, const ReadLimits& limits = {});

/// A row of a file's section table, for --list.
struct SectionSummary {
  std::string kind;   ///< "grid", "ellipsoids", ...; "unknown 0x...." if this reader has no name
  std::string codec;  ///< "raw", "bytes", "floats" or "blosc"
  /// Number of the section's grid, or 0xffffffff for the file. Carried grids have the numbers after
  /// those of the other grids.
  std::uint32_t grid = 0;
  std::uint64_t storedBytes = 0, rawBytes = 0;
  /// The first section of the file that has the same bytes, as an index of EsvrSummary::sections;
  /// nothing for that section itself. The bytes of such a section are not stored again.
  std::optional<std::size_t> sharedWith;
};
struct EsvrSummary {
  std::uint16_t versionMajor = 0, versionMinor = 0;
  std::uint64_t fileBytes = 0;
  std::vector<SectionSummary> sections;
};
/// Reads the header and the section table of a file.
/// \throws BadInput  as for readEsvr
[[nodiscard]] EsvrSummary inspectEsvr(const std::filesystem::path& path);
/// The same for a file or a frame (grid_coding.h) in memory.
/// \param nameForErrors  its name in error texts
[[nodiscard]] EsvrSummary inspectEsvr(std::span<const std::byte> bytes,
                                      const std::string& nameForErrors);

/// Checks a file as readEsvr does, and also that decoding it twice gives the same content.
/// \return remarks on a valid file, one line each: sections that this reader skips, a newer minor
///         version, grids without ellipsoids, carried grids
/// \throws BadInput, MemoryExceeded  as for readEsvr
[[nodiscard]] std::vector<std::string> checkEsvr(const std::filesystem::path& path,
                                                 const ReadLimits& limits = {});

}  // namespace esvr
