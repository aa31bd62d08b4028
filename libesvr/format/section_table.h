#pragma once
/// The header and the section table, which say where everything is in the file.

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "format/byte_source.h"
#include "format/layout.h"

namespace esvr::format {

/// Identifies a section. It is unique in a file.
struct SectionId {
  SectionKind kind{};
  std::uint32_t grid = kNone;
  std::uint32_t chunk = kNone;
  std::uint32_t frame = 0;
  std::uint32_t layer = 0;
  friend constexpr auto operator<=>(const SectionId&, const SectionId&) = default;
};

struct SectionEntry {
  SectionId id;
  Codec codec = Codec::kRaw;
  std::uint16_t flags = 0;
  std::uint64_t offset = 0, storedBytes = 0, rawBytes = 0, checksum = 0;
};

/// Where and how a section is stored: its row of the table without its id. Rows with the same
/// placement share their bytes.
struct Placement {
  std::uint64_t offset = 0, storedBytes = 0, rawBytes = 0, checksum = 0;
  SectionKind kind{};
  Codec codec = Codec::kRaw;
  std::uint16_t flags = 0;
  friend constexpr auto operator<=>(const Placement&, const Placement&) = default;
};
[[nodiscard]] Placement placementOf(const SectionEntry& entry);

struct SectionTable {
  std::uint16_t versionMajor = kVersionMajor, versionMinor = kVersionMinor;
  std::uint64_t fileBytes = 0;
  std::uint64_t tableOffset = kHeaderBytes;
  std::vector<SectionEntry> entries{};
  bool isFrame = false;  ///< the table is that of a frame in the short form (frame_table.h)
};

/// A name for error texts, for example "centers of grid 0, chunk 2".
[[nodiscard]] std::string describe(const SectionId& id);

/// The text for something that is not understood: "format 1.2, this reader knows 1.0".
[[nodiscard]] std::string versions(std::uint16_t versionMajor, std::uint16_t versionMinor);

/// The start of error texts: "file: section 3 (centers of grid 0, chunk 2, at byte 640)".
[[nodiscard]] std::string placeOf(const std::string& file, const SectionTable& table,
                                  std::size_t entry);

/// Encodes the header and the table.
[[nodiscard]] std::vector<std::byte> encodeTable(const SectionTable& table);

/// Reads and checks the header and the table: the version, the checksums, that no two sections have
/// the same id, that sections which share a byte have the same placement, and that the sizes are
/// possible. It reads no section.
/// \throws BadInput
[[nodiscard]] SectionTable readTable(const ByteSource& source);

/// Passes the stored bytes of a section on in pieces, so that they need not be in memory.
void forEachPiece(const ByteSource& source, const SectionEntry& entry,
                  const std::function<void(std::span<const std::byte>)>& use);

/// Checks the checksum of a section. \throws BadInput
void checkStored(const ByteSource& source, const SectionTable& table, std::size_t entry);

/// Reads a section as stored in the file and checks its checksum. \throws BadInput
[[nodiscard]] std::vector<std::byte> readStored(const ByteSource& source, const SectionTable& table,
                                                std::size_t entry);

/// Reads the content of a section. \throws BadInput
[[nodiscard]] std::vector<std::byte> readSection(const ByteSource& source,
                                                 const SectionTable& table, std::size_t entry);

}  // namespace esvr::format
