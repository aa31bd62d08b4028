#include "format/section_writer.h"

#include <algorithm>
#include <bit>

#include "format/byte_writer.h"
#include "format/checksum.h"
#include "format/voxel_section.h"

namespace esvr::format {
namespace {

/// True if two layers are coded alike. Their values are compared by their bits, because 0 and -0
/// are equal.
bool codedAlike(const VoxelLayer& a, const VoxelLayer& b) {
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
  return a == b && bits(a.background) == bits(b.background) &&
         std::ranges::equal(a.palette, b.palette, {}, bits, bits);
}

}  // namespace

void SectionWriter::add(const SectionId& id, std::uint16_t flags, std::vector<std::byte> content,
                        std::size_t typeSize) {
  addPacked(id, flags, pack(std::move(content), typeSize));
}

void SectionWriter::addRaw(const SectionId& id, std::uint16_t flags,
                           std::vector<std::byte> content) {
  const std::uint64_t bytes = content.size();
  addPacked(id, flags, {Codec::kRaw, std::move(content), bytes});
}

void SectionWriter::addVoxels(const SectionId& id, const VoxelLayer& layer) {
  const auto before = std::find_if(coded_.begin(), coded_.end(), [&](const auto& coded) {
    return codedAlike(*coded.first, layer);
  });
  addRaw(id, kRequired, before == coded_.end() ? putVoxels(layer) : contents_[before->second]);
  if (before == coded_.end()) coded_.emplace_back(&layer, contentOf_.back());
}

std::vector<std::byte> SectionWriter::assemble() {
  std::uint64_t end = kHeaderBytes + table_.entries.size() * kEntryBytes;
  std::vector<std::uint64_t> offsets;
  for (const auto& content : contents_) {
    offsets.push_back(alignUp(end));
    end = offsets.back() + content.size();
  }
  table_.fileBytes = end;
  for (std::size_t i = 0; i < contentOf_.size(); ++i)
    table_.entries[i].offset = offsets[contentOf_[i]];

  ByteWriter file;
  file.putAll(encodeTable(table_));
  for (std::size_t c = 0; c < contents_.size(); ++c) {
    file.padTo(offsets[c]);
    file.putAll(contents_[c]);
  }
  return file.take();
}

std::uint64_t SectionWriter::bytesUnshared() const {
  std::uint64_t bytes = 0;
  for (const auto& entry : table_.entries) bytes += kEntryBytes + alignUp(entry.storedBytes);
  return bytes;
}

void SectionWriter::addPacked(const SectionId& id, std::uint16_t flags, Packed packed) {
  SectionEntry entry{id, packed.codec, flags, 0, 0, 0, 0};
  entry.rawBytes = packed.rawBytes;
  entry.storedBytes = packed.bytes.size();
  entry.checksum = checksum(packed.bytes);
  table_.entries.push_back(entry);
  contentOf_.push_back(indexOf(entry, std::move(packed.bytes)));
}

/// The index of the bytes in contents_, to which they are added if no section has them yet.
std::size_t SectionWriter::indexOf(const SectionEntry& entry, std::vector<std::byte> bytes) {
  const Placement placement = placementOf(entry);
  const auto [first, last] = contentsBy_.equal_range(placement);
  const auto same = std::find_if(
      first, last, [&](const auto& candidate) { return contents_[candidate.second] == bytes; });
  if (same != last) return same->second;
  contents_.push_back(std::move(bytes));
  contentsBy_.emplace(placement, contents_.size() - 1);
  return contents_.size() - 1;
}

}  // namespace esvr::format
