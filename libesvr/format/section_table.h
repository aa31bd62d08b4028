#pragma once
/// Where everything is in a file: the numbers that docs/format.md specifies, the header, the section table and its
/// checks, and the codecs in which sections are stored. The bytes of carried grids have a codec of their own
/// (PackedCarried).

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/volume.h"
#include "format/bytes.h"

namespace esvr::format {

// ---- The numbers of the format

/// The first byte is not text, and CR LF LF changes under every conversion of line ends: CR LF to
/// LF, LF to CR LF, and LF to CR.
inline constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'E', 'S', 'V', 'R', '\r', '\n', '\n'};

inline constexpr std::uint16_t kVersionMajor = kFormatVersion;
inline constexpr std::uint16_t kVersionMinor = 6;

inline constexpr std::uint64_t kHeaderBytes = 48;
inline constexpr std::uint64_t kHeaderChecksumAt = 40;
inline constexpr std::uint64_t kEntryBytes = kSectionRowBytes;
inline constexpr std::uint64_t kAlignment = 8;  ///< positions of table and sections

/// The grid or the chunk of a section that belongs to the whole file or to a whole grid.
inline constexpr std::uint32_t kNone = 0xffffffff;

enum class SectionKind : std::uint32_t {
  kFileMetadata = 1,
  kGrid = 2,
  kChunks = 3,
  kBricks = 4,
  kLayerErrors = 6,
  kCurve = 7,
  kCarried = 8,
  kVector = 9,
  kGridRecords = 11,
  kPacked = 12,
  kCenters = 16,
  kScales = 17,
  kRotations = 18,
  kIntensities = 19,
  kKappas = 20,
  kEllipsoids = 32,
  kLayered = 34,
  kMask = 35,
  kVoxels = 36,
  kResidual = 37,
  kCarriedBytes = 38,
  kPredicted = 39,
  kRelated = 41,
  kNonFinite = 42,
  kSequenceIndex = 64,
};

enum class Codec : std::uint16_t {
  kRaw = 0,
  kBytes = 1,
  kFloats = 2,
  kBlosc = 3,  ///< Only carried bytes have this codec.
};

/// Flags of a section.
inline constexpr std::uint16_t kRequired = 1;  ///< readers that do not know the kind refuse

/// Sizes of records.
inline constexpr std::uint64_t kChunkRecordBytes = 44;

/// The name of a kind, for example "centers" or "unknown 0x2a".
[[nodiscard]] std::string nameOf(SectionKind kind);
[[nodiscard]] std::string nameOf(Codec codec);
[[nodiscard]] bool known(SectionKind kind);
/// The first minor version of the format that has a kind.
[[nodiscard]] std::uint16_t minorVersionOf(SectionKind kind);
[[nodiscard]] bool known(Codec codec);

constexpr std::uint64_t alignUp(std::uint64_t offset) {
  return (offset + kAlignment - 1) / kAlignment * kAlignment;
}

// ---- The table

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

/// True if the table is that of a sequence, whose index is one of its sections.
[[nodiscard]] bool isSequence(const SectionTable& table);

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

/// Refuses sections that reach beyond the file, sections that overlap but are not stored alike, two
/// sections with the same id, unknown kinds that are required, unknown codecs, and impossible
/// sizes.
/// \throws BadInput
void checkTable(const std::string& file, const SectionTable& table);

/// Refuses what checkTable() refuses besides the places of the sections. \throws BadInput
void checkRows(const std::string& file, const SectionTable& table);

/// Refuses bytes of a range that are not zero, since they belong to no part of the file. \throws BadInput
void checkZero(const ByteSource& source, std::uint64_t begin, std::uint64_t end);
/// Refuses such bytes that belong to no section. \throws BadInput
void checkGaps(const ByteSource& source, const SectionTable& table);

// ---- Codecs (docs/format.md, "Codecs")

/// The content of a section as it is stored in the file.
struct Packed {
  Codec codec = Codec::kRaw;
  std::vector<std::byte> bytes;
  std::uint64_t rawBytes = 0;
};

/// Compresses content if that saves enough bytes. The same content gives the same bytes.
[[nodiscard]] Packed pack(std::vector<std::byte> raw);
/// The same for content that consists of f32.
[[nodiscard]] Packed packFloats(std::vector<std::byte> raw);

/// True if a codec can make `rawBytes` from `storedBytes`. A reader calls this before it allocates
/// memory.
[[nodiscard]] bool plausibleSizes(Codec codec, std::uint64_t storedBytes, std::uint64_t rawBytes);

/// Decompresses content. The sizes must be plausible. Content that is damaged becomes other content.
/// \throws BadInput  the codec is that of carried grids; the text begins with `where`
[[nodiscard]] std::vector<std::byte> unpack(Codec codec, std::vector<std::byte> stored,
                                            std::uint64_t rawBytes, const std::string& where);

// ---- Reading sections

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

// ---- The bytes of carried grids. They may be too large for the heap, and Blosc compresses them

/// Bytes as they are stored in the file.
struct PackedCarried {
  Codec codec = Codec::kRaw;
  VoxelArray<std::byte> bytes;
};

/// Compresses bytes if that saves enough of them. The result is in the same memory.
[[nodiscard]] PackedCarried packCarried(const VoxelArray<std::byte>& raw);

/// Reads the content of a section into an array of this memory, piece by piece, so that its stored bytes
/// need not be in memory. The decoder-only build, which has no Blosc, throws RuntimeFailure instead.
/// \throws BadInput
[[nodiscard]] VoxelArray<std::byte> readCarried(const ByteSource& source, const SectionTable& table,
                                                std::size_t entry, const VoxelMemory& memory);

}  // namespace esvr::format
