#include "format/section_writer.h"

#include <algorithm>
#include <bit>

#include "format/bytes.h"
#include "format/voxel_sections.h"

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

void SectionWriter::add(const SectionId& id, std::uint16_t flags, std::vector<std::byte> content) {
  addPacked(id, flags, pack(std::move(content)));
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

void SectionWriter::addCarried(const SectionId& id, const VoxelArray<std::byte>& content) {
  PackedCarried packed = packCarried(content);
  SectionEntry entry{id, packed.codec, 0, 0, 0, 0, 0};
  entry.rawBytes = content.size();
  addContent(entry, {{}, std::move(packed.bytes)});
}

void SectionWriter::Arrangement::add(const SectionEntry& row, std::span<const std::byte> content,
                                     std::size_t number) {
  const auto same = std::ranges::find(numbers, number);
  contentOf.push_back(std::size_t(same - numbers.begin()));
  if (same == numbers.end()) {
    numbers.push_back(number);
    contents.push_back(content);
  }
  table.versionMinor = std::max(table.versionMinor, minorVersionOf(row.id.kind));
  table.entries.push_back(row);
}

std::uint64_t SectionWriter::Arrangement::bytes() const {
  std::uint64_t end = kHeaderBytes + table.entries.size() * kEntryBytes;
  for (const auto& content : contents) end = alignUp(end) + content.size();
  return end;
}

std::span<const std::byte> SectionWriter::contentOfRow(std::size_t row) const {
  return contents_[contentOf_[row]].bytes();
}

SectionWriter::Arrangement SectionWriter::plain() const {
  Arrangement all{{.versionMinor = leastVersion_}};
  for (std::size_t i = 0; i < table_.entries.size(); ++i)
    all.add(table_.entries[i], contentOfRow(i), contentOf_[i]);
  return all;
}

SectionWriter::Arrangement SectionWriter::packed() const {
  Arrangement small{{.versionMinor = leastVersion_}}, large{{.versionMinor = 0}};
  for (std::size_t i = 0; i < table_.entries.size(); ++i) {
    const auto content = contentOfRow(i);
    auto& part = content.size() <= kLargestPacked ? small : large;
    part.add(table_.entries[i], content, contentOf_[i]);
  }
  Arrangement all{{.versionMinor = small.table.versionMinor}};
  all.packed = putFrame({{}, small.table}, {small.contents, small.contentOf});
  SectionEntry row{{SectionKind::kPacked}, Codec::kRaw, kRequired};
  row.storedBytes = row.rawBytes = all.packed.size();
  row.checksum = checksum(all.packed);
  all.add(row, all.packed, contents_.size());
  for (std::size_t i = 0; i < large.table.entries.size(); ++i) {
    const std::size_t content = large.contentOf[i];
    all.add(large.table.entries[i], large.contents[content], large.numbers[content]);
  }
  return all;
}

SectionWriter::Arrangement SectionWriter::arranged() const {
  Arrangement all = plain();
  if (layout_ == FileLayout::kPlain) return all;
  Arrangement smaller = packed();
  return smaller.bytes() < all.bytes() ? std::move(smaller) : std::move(all);
}

std::uint64_t SectionWriter::writeTo(const Sink& sink) const {
  Arrangement all = arranged();
  const std::uint64_t end = all.bytes();
  std::vector<std::uint64_t> offsets;
  std::uint64_t at = kHeaderBytes + all.table.entries.size() * kEntryBytes;
  for (const auto& content : all.contents) {
    offsets.push_back(alignUp(at));
    at = offsets.back() + content.size();
  }
  all.table.fileBytes = end;
  for (std::size_t i = 0; i < all.contentOf.size(); ++i)
    all.table.entries[i].offset = offsets[all.contentOf[i]];

  const auto head = encodeTable(all.table);
  sink(head);
  at = head.size();
  for (std::size_t c = 0; c < all.contents.size(); ++c) {
    sink(std::vector<std::byte>(offsets[c] - at));
    sink(all.contents[c]);
    at = offsets[c] + all.contents[c].size();
  }
  return end;
}

std::vector<std::byte> SectionWriter::assemble() const {
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
