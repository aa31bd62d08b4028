#include "fuzz/repair.h"

#include <algorithm>
#include <cstring>

#include "format/checksum.h"
#include "format/layout.h"

namespace esvr::fuzz {
namespace {

using namespace format;

/// Offsets in the header and in an entry of the table (docs/format.md).
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

/// The part of the file that an offset and a size name; empty where it lies outside.
std::span<std::byte> part(std::span<std::byte> file, std::uint64_t offset, std::uint64_t size) {
  const bool inside = offset <= file.size() && size <= file.size() - offset;
  return inside ? file.subspan(offset, size) : std::span<std::byte>{};
}

void repairEntry(std::span<std::byte> file, std::span<std::byte> entry) {
  const auto section = part(file, load<std::uint64_t>(entry, kEntryOffsetAt),
                            load<std::uint64_t>(entry, kEntryStoredAt));
  store(entry, kEntryChecksumAt, checksum(section));
}

void repairTable(std::span<std::byte> file) {
  const auto table = part(file, load<std::uint64_t>(file, kTableAt),
                          load<std::uint32_t>(file, kSectionsAt) * kEntryBytes);
  for (std::size_t at = 0; at < table.size(); at += kEntryBytes)
    repairEntry(file, table.subspan(at, kEntryBytes));
  store(file, kTableChecksumAt, checksum(table));
}

}  // namespace

std::vector<std::byte> repaired(std::span<const std::byte> bytes) {
  std::vector<std::byte> file(bytes.begin(), bytes.end());
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
