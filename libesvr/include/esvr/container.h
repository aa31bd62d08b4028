#pragma once
/// The .esvr container: reads, writes and inspects files. docs/format.md specifies every byte.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"
#include "esvr/fit_record.h"
#include "esvr/grid_descriptor.h"
#include "esvr/memory_limit.h"
#include "esvr/quantised.h"
#include "esvr/sparse_volume.h"
#include "esvr/voxel_layer.h"

namespace esvr {

inline constexpr std::uint16_t kFormatVersion = 1;

/// How active voxels are found again when the grid is revoxelised.
enum class TopologyKind {
  kThreshold = 0,  ///< active where |V - background| > activeThreshold
  /// As kThreshold, within the stored bricks only. In a level set: the narrow band there, active
  /// where |V| < background - activeThreshold.
  kLeaves = 1,
  kMask = 2,  ///< the voxels of `mask`, whatever their values
};

/// The error of the first importance layers of every chunk, against the source. A row of a grid's
/// table, one for each layer.
struct LayerError {
  float psnrBox = 0.0f;   ///< dB, over the box of the conversion; infinite where there is no error
  float maxError = 0.0f;  ///< largest absolute error
  friend bool operator==(const LayerError&, const LayerError&) = default;
};

/// One grid of a file.
struct StoredGrid {
  GridDescriptor descriptor;
  Field field;
  TopologyKind topology = TopologyKind::kThreshold;
  float activeThreshold = 0.0f;  ///< negative: active everywhere
  std::vector<Coord>
      leaves;  ///< kLeaves, kMask: index corners of the source's bricks, increasing; else empty
  std::vector<BrickMask> mask;             ///< kMask: active voxels of each of the leaves
  bool withinRange = true;                 ///< values come back within that of the source, below
  Box activeBox;                           ///< the source's, index coordinates
  std::uint64_t activeVoxels = 0;          ///< the source's
  float valueMin = 0.0f, valueMax = 0.0f;  ///< over the source's active voxels
  std::vector<CurvePoint> curve;
  /// Empty: the ellipsoids are stored as float32. Else one for every chunk of the field, whose
  /// ellipsoids are then exactly what it stands for (dequantise).
  std::vector<QuantisedEllipsoids> quantised;
  std::vector<LayerError> layerErrors;  ///< empty, or one for each of the most layers of a chunk
  /// Added to the sum, voxel by voxel, before it is told which are active; of VoxelForm::kLattice,
  /// all of them active, 0 in other bricks. Not together with `voxels`.
  std::optional<VoxelLayer> residual;
  /// The voxels themselves, exact or within a bound: what decodeGrid() gives back then.
  std::optional<VoxelLayer> voxels;
};

/// Bytes that a grid's quantised ellipsoids take, by stream.
struct StreamBytes {
  std::uint64_t positions = 0, scales = 0, rotations = 0, intensities = 0;
};
[[nodiscard]] StreamBytes streamBytes(const StoredGrid& grid);

/// Importance layers of a grid: the most that a chunk of it has, 1 where nothing is layered, 0
/// without ellipsoids.
[[nodiscard]] std::size_t layerCount(const StoredGrid& grid);

/// The size of each layer of a grid whose ellipsoids are quantised; empty where they are not.
struct LayerSize {
  std::uint64_t ellipsoids = 0, bytes = 0;
};
[[nodiscard]] std::vector<LayerSize> layerSizes(const StoredGrid& grid);

struct EsvrFile {
  std::vector<MetaItem> metadata;  ///< the source's file-level metadata, verbatim
  std::vector<StoredGrid> grids;
};

struct ContainerWriteOptions {
  bool overwrite = false;
};

/// Writes to a temporary file beside `path`, flushes and renames it.
/// \return the bytes written
/// \throws RuntimeFailure  exists (without overwrite), not writable, disk full (a limit on the
///                         file's size too, where the program ignores SIGXFSZ); as encodeEsvr
std::uint64_t writeEsvr(const std::filesystem::path& path, const EsvrFile& file,
                        const ContainerWriteOptions& options = {});

/// Bounds on what reading takes. Few bytes of a file may stand for many: a section may be
/// compressed, and equal ellipsoids or voxels cost next to nothing.
struct ReadLimits {
  std::uint64_t maxBytes = kNoMemoryLimit;
};

/// Reads a whole file. Trusts nothing: every size is checked before it is allocated, every section
/// against its checksum, every parameter for being finite.
/// \throws BadInput  missing, not an .esvr, a newer major version, truncated or damaged (says
/// where); MemoryExceeded: its content takes more memory than the limits allow
[[nodiscard]] EsvrFile readEsvr(const std::filesystem::path& path, const ReadLimits& limits = {});

/// The part of a file that is wanted. Whether a section is needed follows from the section table,
/// chunk records and directories of blocks. A grid that is stored as voxels is read whole.
struct ReadPart {
  /// Only what can reach these voxels: every ellipsoid whose support meets the box is there, others
  /// may be.
  std::optional<Box> box{};
  std::optional<std::size_t> layers{};  ///< at most so many importance layers, from the heaviest
  /// As many of these as it takes for so many ellipsoids: whole layers, so there may be more.
  std::optional<std::size_t> ellipsoids{};
  ReadLimits limits{};
};

struct PartOfFile {
  EsvrFile file;  ///< a whole file of what was read; layer errors only where no box was given
  std::uint64_t bytesRead = 0;
};

/// Reads what is needed and nothing else, which is therefore not checked.
/// \throws BadInput, MemoryExceeded  as readEsvr
[[nodiscard]] PartOfFile readEsvrPart(const std::filesystem::path& path, const ReadPart& part);

/// Bytes that a grid adds to a file at most: its sections, the padding before and behind them, and
/// its rows of the section table. A file takes no more than bytesBesideGrids() and the sum of
/// these.
/// \throws RuntimeFailure  as encodeEsvr
[[nodiscard]] std::uint64_t bytesAdded(const StoredGrid& grid);

/// Bytes of a file without grids, with the padding before the first.
[[nodiscard]] std::uint64_t bytesBesideGrids(const std::vector<MetaItem>& metadata);

/// The same from and to memory. The same content gives the same bytes. A chunk's ellipsoids are
/// stored in Morton order of their centers: what comes back is that order, bit for bit the same
/// ellipsoids.
/// \throws RuntimeFailure  what no reader would accept: a number that is not finite, a quaternion
/// not
///                         of unit length, leaves that are no increasing brick corners
[[nodiscard]] std::vector<std::byte> encodeEsvr(const EsvrFile& file);
/// \throws BadInput  as readEsvr
[[nodiscard]] EsvrFile decodeEsvr(std::span<const std::byte> bytes,
                                  const std::string& nameForErrors);

/// A row of a file's section table, for --list.
struct SectionSummary {
  std::string
      kind;  ///< "grid", "ellipsoids", ...; "unknown 0x...." where this reader does not know it
  std::string codec;       ///< "raw", "blosc"
  std::uint32_t grid = 0;  ///< grid it belongs to, or 0xffffffff for the file
  std::uint64_t storedBytes = 0, rawBytes = 0;
};
struct EsvrSummary {
  std::uint16_t versionMajor = 0, versionMinor = 0;
  std::uint64_t fileBytes = 0;
  std::vector<SectionSummary> sections;
};
/// Reads header and section table only. \throws BadInput
[[nodiscard]] EsvrSummary inspectEsvr(const std::filesystem::path& path);

/// All that readEsvr checks, and that decoding twice gives one content.
/// \return what a user may want to know of a file that is whole, a line each: sections that this
///         reader skips, a newer minor version, grids without ellipsoids
/// \throws BadInput, MemoryExceeded  as readEsvr
[[nodiscard]] std::vector<std::string> checkEsvr(const std::filesystem::path& path,
                                                 const ReadLimits& limits = {});

}  // namespace esvr
