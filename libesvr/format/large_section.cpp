#include "format/large_section.h"

#include <algorithm>
#include <functional>

#include "core/parallel.h"
#include "esvr/error.h"
#include "format/checksum.h"
#include "format/codec.h"

namespace esvr::format {
namespace {

constexpr std::uint64_t kPieceBytes = 1 << 20;

/// Reads the stored bytes of a section in pieces.
void forEachPiece(const ByteSource& source, const SectionEntry& entry,
                  const std::function<void(std::span<const std::byte>)>& use) {
  const std::uint64_t end = entry.offset + entry.storedBytes;
  for (std::uint64_t at = entry.offset; at < end; at += std::min(kPieceBytes, end - at)) {
    throwIfCancelled();
    use(source.read(at, std::min(kPieceBytes, end - at)));
  }
}

VoxelArray<std::byte> readRaw(const ByteSource& source, const SectionEntry& entry,
                              const VoxelMemory& memory) {
  VoxelArray<std::byte> content(entry.rawBytes, memory);
  auto to = content.begin();
  forEachPiece(source, entry, [&](auto piece) { to = std::ranges::copy(piece, to).out; });
  return content;
}

VoxelArray<std::byte> readBlosc(const ByteSource& source, const SectionEntry& entry,
                                const std::string& where, const VoxelMemory& memory) {
  VoxelArray<std::byte> content(paddedForBlosc(entry.rawBytes), memory);
  const PartSource stored(source, entry.offset, entry.storedBytes, where);
  std::span<std::byte> left(content);
  std::uint64_t at = 0;
  while (at < stored.size() || !left.empty()) {
    throwIfCancelled();
    const auto buffer = stored.read(at, storedBytesOf(stored.read(at, kBloscHeaderBytes)));
    left = left.subspan(decompressBuffer(buffer, left, where));
    at += buffer.size();
  }
  refuseContentAfter(entry.rawBytes, content, where);
  content.resize(entry.rawBytes);
  return content;
}

}  // namespace

void checkStored(const ByteSource& source, const SectionTable& table, std::size_t entry) {
  RunningChecksum sum;
  forEachPiece(source, table.entries[entry], [&](auto piece) { sum.add(piece); });
  if (sum.value() != table.entries[entry].checksum)
    throw BadInput(placeOf(source.name(), table, entry) + ": checksum does not match");
}

VoxelArray<std::byte> readLarge(const ByteSource& source, const SectionTable& table,
                                std::size_t entry, const VoxelMemory& memory) {
  checkStored(source, table, entry);
  const SectionEntry& e = table.entries[entry];
  if (e.codec == Codec::kRaw) return readRaw(source, e, memory);
  return readBlosc(source, e, placeOf(source.name(), table, entry), memory);
}

}  // namespace esvr::format
