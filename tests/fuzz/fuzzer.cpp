#include "fuzz/fuzzer.h"

#include <algorithm>
#include <cstring>
#include <map>

#include "format/bytes.h"
#include "format/frame_table.h"
#include "format/section_table.h"

namespace esvr::fuzz {
namespace {

using namespace format;

/// Offsets in the header and in an entry of the section table (docs/format.md).
constexpr std::size_t kVersionAt = 8, kSectionsAt = 12, kSizeAt = 16, kTableAt = 24,
                      kTableChecksumAt = 32;
constexpr std::size_t kEntryOffsetAt = 24, kEntryStoredAt = 32, kEntryChecksumAt = 48;

template <class T>
T load(std::span<const std::byte> bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}
template <class T>
void store(std::span<std::byte> bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// The part of the file at an offset; empty if it does not lie in the file.
std::span<std::byte> part(std::span<std::byte> file, std::uint64_t offset, std::uint64_t size) {
  const bool inside = offset <= file.size() && size <= file.size() - offset;
  return inside ? file.subspan(offset, size) : std::span<std::byte>{};
}

/// Offsets and sizes in the section of layered ellipsoids.
constexpr std::size_t kThresholdsAt = 78, kLayersAt = 79, kBlockBytesAt = 6, kBlockSumAt = 22,
                      kBlockEntryBytes = 30, kSumBytes = 8;

void repairBlock(std::span<std::byte> section, std::span<std::byte> entry, std::size_t& at) {
  std::size_t size = 0;
  for (std::size_t s = 0; s < 4; ++s) size += load<std::uint32_t>(entry, kBlockBytesAt + 4 * s);
  store(entry, kBlockSumAt, checksum(part(section, at, size)));
  at += size;
}

/// Corrects the checksums of the directory and of every block.
void repairLayered(std::span<std::byte> section) {
  if (section.size() <= kLayersAt) return;
  const std::size_t size = load<std::uint32_t>(section, 0);
  const auto layers = part(section, kLayersAt + load<std::uint8_t>(section, kThresholdsAt), 1);
  if (layers.empty() || size > section.size() || size < kLayersAt + kSumBytes) return;
  std::size_t entry = std::size_t(layers.data() - section.data()) + 1 +
                      sizeof(std::uint64_t) * load<std::uint8_t>(layers, 0);
  for (std::size_t at = size; entry + kBlockEntryBytes + kSumBytes <= size;
       entry += kBlockEntryBytes)
    repairBlock(section, section.subspan(entry, kBlockEntryBytes), at);
  store(section, size - kSumBytes, checksum(section.first(size - kSumBytes)));
}

/// Offsets and sizes in the index of a sequence, and in an entry of a frame.
constexpr std::size_t kFrameBytesAt = 8, kFrameSumAt = 16, kFrameEntryBytes = 28;
constexpr std::size_t kDirectorySize = sizeof(std::uint32_t) + sizeof(std::uint64_t);

/// Corrects the checksums of the frames of a group in the index.
/// \param at  offset of the group in the file
/// \return offset of the next group
std::uint64_t repairGroup(std::span<std::byte> file, std::span<std::byte> entries,
                          std::uint64_t at) {
  at = alignUp(at + kDirectorySize + entries.size());
  for (std::size_t e = 0; e < entries.size(); e += kFrameEntryBytes) {
    const auto entry = entries.subspan(e, kFrameEntryBytes);
    const auto frame = part(file, at, load<std::uint64_t>(entry, kFrameBytesAt));
    store(entry, kFrameSumAt, checksum(frame));
    at = alignUp(at + frame.size());
  }
  return at;
}

void repairIndex(std::span<std::byte> file, std::span<std::byte> index) {
  std::uint64_t group = kHeaderBytes;
  std::size_t at = sizeof(std::uint32_t);
  while (at + sizeof(std::uint32_t) <= index.size()) {
    const std::size_t bytes = load<std::uint32_t>(index, at) * kFrameEntryBytes;
    at += sizeof(std::uint32_t);
    if (bytes > index.size() - at) return;
    group = repairGroup(file, index.subspan(at, bytes), group);
    at += bytes;
  }
}

/// Corrects the checksum at the end of a frame in the short form.
void repairFrame(std::span<std::byte> frame) {
  const std::size_t size = frame.size() - kSumBytes;
  store(frame, size, checksum(frame.first(size)));
}

void repairEntry(std::span<std::byte> file, std::span<std::byte> entry) {
  const auto section = part(file, load<std::uint64_t>(entry, kEntryOffsetAt),
                            load<std::uint64_t>(entry, kEntryStoredAt));
  if (load<std::uint32_t>(entry, 0) == std::uint32_t(SectionKind::kLayered)) repairLayered(section);
  if (load<std::uint32_t>(entry, 0) == std::uint32_t(SectionKind::kSequenceIndex))
    repairIndex(file, section);
  if (load<std::uint32_t>(entry, 0) == std::uint32_t(SectionKind::kPacked) &&
      section.size() > kSumBytes)
    repairFrame(section);
  store(entry, kEntryChecksumAt, checksum(section));
}

void repairTable(std::span<std::byte> file) {
  const auto table = part(file, load<std::uint64_t>(file, kTableAt),
                          load<std::uint32_t>(file, kSectionsAt) * kEntryBytes);
  for (std::size_t at = 0; at < table.size(); at += kEntryBytes)
    repairEntry(file, table.subspan(at, kEntryBytes));
  store(file, kTableChecksumAt, checksum(table));
}

std::map<std::string_view, Fuzzer>& table() {
  static std::map<std::string_view, Fuzzer> all;  // fuzzers are added before main
  return all;
}

}  // namespace

bool addFuzzer(std::string_view name, Fuzzer fuzzer) {
  return table().emplace(name, fuzzer).second;
}

Fuzzer findFuzzer(std::string_view name) {
  const auto found = table().find(name);
  return found == table().end() ? nullptr : found->second;
}

std::vector<std::byte> repaired(std::span<const std::byte> bytes) {
  std::vector<std::byte> file(bytes.begin(), bytes.end());
  if (isShortFrame(bytes) && file.size() > kSumBytes) {
    repairFrame(file);
    return file;
  }
  if (file.size() < kHeaderBytes) return file;
  const auto magic = std::as_bytes(std::span(kMagic));
  std::copy(magic.begin(), magic.end(), file.begin());
  store(std::span(file), kVersionAt, kVersionMajor);
  store(std::span(file), kSizeAt, std::uint64_t(file.size()));
  repairTable(file);
  store(std::span(file), kHeaderChecksumAt, checksum(std::span(file).first(kHeaderChecksumAt)));
  return file;
}

}  // namespace esvr::fuzz
