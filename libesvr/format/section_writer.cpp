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
  addRaw(id, kRequired, before == coded_.end() ? putVoxels(layer) : contents_[before->second].heap);
  if (before == coded_.end()) coded_.emplace_back(&layer, contentOf_.back());
}

void SectionWriter::addLarge(const SectionId& id, const VoxelArray<std::byte>& content) {
  PackedLarge packed = packLarge(content);
  SectionEntry entry{id, packed.codec, 0, 0, 0, 0, 0};
  entry.rawBytes = content.size();
  addContent(entry, {{}, std::move(packed.bytes)});
}

std::uint64_t SectionWriter::writeTo(const Sink& sink) {
  std::uint64_t end = kHeaderBytes + table_.entries.size() * kEntryBytes;
  std::vector<std::uint64_t> offsets;
  for (const auto& content : contents_) {
    offsets.push_back(alignUp(end));
    end = offsets.back() + content.bytes().size();
  }
  table_.fileBytes = end;
  for (std::size_t i = 0; i < contentOf_.size(); ++i)
    table_.entries[i].offset = offsets[contentOf_[i]];

  const auto head = encodeTable(table_);
  sink(head);
  std::uint64_t at = head.size();
  for (std::size_t c = 0; c < contents_.size(); ++c) {
    sink(std::vector<std::byte>(offsets[c] - at));
    sink(contents_[c].bytes());
    at = offsets[c] + contents_[c].bytes().size();
  }
  return end;
}

std::vector<std::byte> SectionWriter::assemble() {
  ByteWriter file;
  writeTo([&](auto piece) { file.putAll(piece); });
  return file.take();
}

std::vector<std::byte> SectionWriter::assembleFrame(const Inherited& inherited) const {
  FrameContents contents{{}, contentOf_};
  for (const Content& content : contents_) contents.contents.push_back(content.bytes());
  return putFrame({inherited, table_}, contents);
}

std::uint64_t SectionWriter::bytesUnshared() const {
  std::uint64_t bytes = 0;
  for (const auto& entry : table_.entries) bytes += kEntryBytes + alignUp(entry.storedBytes);
  return bytes;
}

std::span<const std::byte> SectionWriter::Content::bytes() const {
  return heap.empty() ? std::span<const std::byte>(large) : std::span<const std::byte>(heap);
}

void SectionWriter::addPacked(const SectionId& id, std::uint16_t flags, Packed packed) {
  SectionEntry entry{id, packed.codec, flags, 0, 0, 0, 0};
  entry.rawBytes = packed.rawBytes;
  addContent(entry, {std::move(packed.bytes), {}});
}

void SectionWriter::addContent(SectionEntry entry, Content content) {
  entry.storedBytes = content.bytes().size();
  entry.checksum = checksum(content.bytes());
  table_.versionMinor = std::max(table_.versionMinor, minorVersionOf(entry.id.kind));
  table_.entries.push_back(entry);
  contentOf_.push_back(indexOf(entry, std::move(content)));
}

/// The index of the bytes in contents_, to which they are added if no section has them yet.
std::size_t SectionWriter::indexOf(const SectionEntry& entry, Content content) {
  const Placement placement = placementOf(entry);
  const auto [first, last] = contentsBy_.equal_range(placement);
  const auto same = std::find_if(first, last, [&](const auto& candidate) {
    return std::ranges::equal(contents_[candidate.second].bytes(), content.bytes());
  });
  if (same != last) return same->second;
  contents_.push_back(std::move(content));
  contentsBy_.emplace(placement, contents_.size() - 1);
  return contents_.size() - 1;
}

}  // namespace esvr::format
