#pragma once
/// The records of a file, which describe everything but bricks, ellipsoids and voxels: metadata, grids and chunks,
/// carried grids, the curve of a fit and the errors of importance layers; and the rules that they must obey.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/geometry.h"
#include "esvr/container.h"
#include "esvr/ellipsoids.h"
#include "esvr/grid.h"
#include "format/bytes.h"
#include "format/section_reader.h"
#include "format/section_table.h"

namespace esvr::format {

/// The record of a chunk, which is read before its ellipsoids.
struct ChunkRecord {
  Coord origin;
  Box box;  ///< index coordinates; contains every support
  std::uint64_t count = 0;
};

/// The record of a grid: everything but its bricks, curve and ellipsoids.
struct GridRecord {
  StoredGrid grid;  ///< its field has no chunks yet
  std::uint32_t chunkCount = 0;
  std::vector<ChunkRecord> chunks;  ///< a single chunk's record; empty if there are more
};

// The sides of code...() are ByteWriter and ByteReader (bytes.h).

template <class Side>
void codeCoord(Side& side, Coded<Side, Coord>& c) {
  for (const auto axis : kAxes) code(side, c.*axis);
}

template <class Side>
void codeMetadata(Side& side, Coded<Side, std::vector<MetaItem>>& items);

template <class Side>
void codeChunk(Side& side, Coded<Side, ChunkRecord>& chunk);

void putGrid(ByteWriter& out, const StoredGrid& grid, const std::vector<ChunkRecord>& chunks);
[[nodiscard]] GridRecord getGrid(ByteReader& in);

// ---- The record of a grid of a frame as its difference from that of the previous frame

/// Writes the record of a grid, without chunks.
void putRecordAfter(ByteWriter& out, const StoredGrid& grid, const StoredGrid& previous);

/// Reads it again. \throws BadInput  it does not belong to this previous grid, or is damaged
[[nodiscard]] StoredGrid getRecordAfter(ByteReader& in, const StoredGrid& previous,
                                        const std::string& where);

// ---- The record of a carried grid: everything but its bytes

template <class Side>
void codeCarried(Side& side, Coded<Side, CarriedGrid>& grid);

// ---- The curve of a fit as the content of a section: one array for each quantity

/// \throws RuntimeFailure  an error is not finite, or a PSNR is NaN
[[nodiscard]] std::vector<std::byte> putCurve(std::span<const CurvePoint> curve);

/// \throws BadInput  as putCurve, or the size is wrong; the text begins with `where`
[[nodiscard]] std::vector<CurvePoint> getCurve(std::span<const std::byte> content,
                                               const std::string& where);

// ---- The errors of the importance layers as the content of a section

[[nodiscard]] std::vector<std::byte> putLayerErrors(std::span<const LayerError> errors);

/// \throws BadInput  there is not one error for each of `layers`, or one is not a number; the text
///                   begins with `where`
[[nodiscard]] std::vector<LayerError> getLayerErrors(std::span<const std::byte> content,
                                                     std::size_t layers, const std::string& where);

// ---- The records of all grids in one section, which is compressed as a whole (docs/format.md, "Grid records")

/// Joins encoded grid records.
[[nodiscard]] std::vector<std::byte> putRecords(const std::vector<std::vector<std::byte>>& records);

/// The records of the grids of a file, each in its own section or all in one.
class GridRecords {
 public:
  /// \throws BadInput  the section of all records is damaged
  explicit GridRecords(SectionReader& sections);

  /// Number of grids that have a record.
  [[nodiscard]] std::uint32_t count() const;

  /// The record of a grid. It is called once for each grid that has a record, in their order.
  /// \throws BadInput
  [[nodiscard]] std::vector<std::byte> take(std::uint32_t grid);

  /// Start of the text of an error about a record.
  [[nodiscard]] std::string place(std::uint32_t grid) const;

 private:
  SectionReader& sections_;
  bool isJoined_ = false;
  std::vector<std::vector<std::byte>> joined_;
  std::size_t next_ = 0;  ///< index of the next one of them
};

// ---- The rules that a grid must obey to be written. A reader refuses a grid that breaks them.

/// A broken rule, and the section whose content breaks it.
struct Fault {
  SectionKind section;
  std::string text;
};

/// A map whose number of bytes is not that of its type, if the type is one of OpenVDB's own. Grids
/// with such a map can be read, but no VDB file can be made of them.
[[nodiscard]] std::optional<Fault> mapFaultOf(const Transform& transform);

/// Checks all but bricks, curve and chunks: numbers must be finite, the kernel must be possible to
/// evaluate, and ranges must be in order.
[[nodiscard]] std::optional<Fault> faultOf(const StoredGrid& grid);

[[nodiscard]] std::optional<Fault> residualFaultOf(const StoredGrid& grid);

/// The components of a grid of vectors must agree in class, value type and transform.
[[nodiscard]] std::optional<Fault> faultOf(StoredComponents components);

/// Parameters must be finite, scales within kMaxLogScale and quaternions of unit length.
[[nodiscard]] std::optional<Fault> faultOf(const Ellipsoids& ellipsoids);

}  // namespace esvr::format
