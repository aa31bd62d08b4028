#pragma once
/// The numbers of the .esvr file that docs/format.md specifies: magic, sizes, section kinds,
/// codecs.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "esvr/container.h"

namespace esvr::format {

/// The first byte is not text, and CR LF LF changes under every conversion of line ends: CR LF to
/// LF, LF to CR LF, and LF to CR.
inline constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'E', 'S', 'V', 'R', '\r', '\n', '\n'};

inline constexpr std::uint16_t kVersionMajor = kFormatVersion;
inline constexpr std::uint16_t kVersionMinor = 5;

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
  kLevels = 43,
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

}  // namespace esvr::format
