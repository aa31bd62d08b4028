#pragma once
/// The short form of a table, which has a few bytes for each section, and one checksum for all of them. A frame that
/// refers to the previous one has it (docs/format.md, "Frames"), and so has the section that holds the small sections
/// of a file, which then need no rows of the section table ("Packed sections").

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "format/section_table.h"

namespace esvr::format {

/// The first byte; no file begins with it.
inline constexpr std::byte kFrameMark{0x46};

/// Largest number of bytes that a section takes besides its content if numbers of grids, chunks and
/// contents are below 2^14.
inline constexpr std::uint64_t kFrameRowBytes = 24;

/// What a frame has in common with the previous one, so that it is not stored.
struct Inherited {
  bool metadata = false, vectors = false, carried = false;
  friend bool operator==(const Inherited&, const Inherited&) = default;
};

/// The sections of a frame.
struct FrameTable {
  Inherited inherited;
  SectionTable sections;  ///< rows with the same placement share their bytes
};

/// The content of each row of a table.
struct FrameContents {
  std::vector<std::span<const std::byte>> contents;  ///< without repetitions
  std::vector<std::size_t> contentOf;                ///< by row: index in `contents`
};

/// Encodes a frame. \param table  its offsets and checksums are not used
[[nodiscard]] std::vector<std::byte> putFrame(const FrameTable& table,
                                              const FrameContents& contents);

[[nodiscard]] bool isShortFrame(std::span<const std::byte> bytes);

/// Reads the table of a frame in the short form, and checks the frame's checksum.
/// \param name  start of error texts
/// \throws BadInput
[[nodiscard]] FrameTable getFrame(std::span<const std::byte> bytes, const std::string& name);

// ---- Packed sections

/// Largest number of bytes of a section that is packed.
inline constexpr std::uint64_t kLargestPacked = 4096;

/// Adds the rows of packed sections to a table, if the file has any. The section that holds them is
/// read and verified.
/// \throws BadInput  it is damaged
void addPackedRows(const ByteSource& source, SectionTable& table);

/// The header and the section table of a file, and the rows of packed sections after its own.
/// \throws BadInput  as for readTable
[[nodiscard]] SectionTable readAllRows(const ByteSource& source);

}  // namespace esvr::format
