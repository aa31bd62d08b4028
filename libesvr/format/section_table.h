#pragma once
/// Header and section table: where everything lies in the file.

#include <compare>
#include <cstddef>
#include <cstdint>
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

struct SectionTable {
  std::uint16_t versionMajor = kVersionMajor, versionMinor = kVersionMinor;
  std::uint64_t fileBytes = 0;
  std::uint64_t tableOffset = kHeaderBytes;
  std::vector<SectionEntry> entries;
};

/// "centers of grid 0, chunk 2".
[[nodiscard]] std::string describe(const SectionId& id);

/// "format 1.2, this reader knows 1.0": what to say where something is not understood.
[[nodiscard]] std::string versions(std::uint16_t versionMajor, std::uint16_t versionMinor);

/// "file: section 3 (centers of grid 0, chunk 2, at byte 640)": begins errors.
[[nodiscard]] std::string placeOf(const std::string& file, const SectionTable& table,
                                  std::size_t entry);

/// Header and table as bytes.
[[nodiscard]] std::vector<std::byte> encodeTable(const SectionTable& table);

/// Reads and checks header and table: version, checksums, no two sections of one id or one byte,
/// sizes that can be. Reads none of the sections.
/// \throws BadInput
[[nodiscard]] SectionTable readTable(const ByteSource& source);

/// A section as it lies in the file, checksum checked. \throws BadInput
[[nodiscard]] std::vector<std::byte> readStored(const ByteSource& source, const SectionTable& table,
                                                std::size_t entry);

/// A section's content. \throws BadInput
[[nodiscard]] std::vector<std::byte> readSection(const ByteSource& source,
                                                 const SectionTable& table, std::size_t entry);

}  // namespace esvr::format
