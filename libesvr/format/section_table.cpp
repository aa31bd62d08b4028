#include "format/section_table.h"

#include <algorithm>

#include "core/parallel.h"
#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"
#include "format/checksum.h"
#include "format/codec.h"
#include "format/table_check.h"

namespace esvr::format {
namespace {

/// The header's content.
struct Header {
  std::uint16_t versionMajor = 0, versionMinor = 0;
  std::uint32_t sections = 0;
  std::uint64_t fileBytes = 0, tableOffset = 0, tableChecksum = 0;
};

void putEntry(ByteWriter& out, const SectionEntry& e) {
  out.put(static_cast<std::uint32_t>(e.id.kind));
  out.put(static_cast<std::uint16_t>(e.codec));
  out.put(e.flags);
  for (const auto index : {e.id.grid, e.id.chunk, e.id.frame, e.id.layer}) out.put(index);
  for (const auto size : {e.offset, e.storedBytes, e.rawBytes, e.checksum}) out.put(size);
}

SectionEntry getEntry(ByteReader& in) {
  SectionEntry e;
  e.id.kind = static_cast<SectionKind>(in.get<std::uint32_t>());
  e.codec = static_cast<Codec>(in.get<std::uint16_t>());
  e.flags = in.get<std::uint16_t>();
  for (auto* index : {&e.id.grid, &e.id.chunk, &e.id.frame, &e.id.layer})
    *index = in.get<std::uint32_t>();
  for (auto* size : {&e.offset, &e.storedBytes, &e.rawBytes, &e.checksum})
    *size = in.get<std::uint64_t>();
  return e;
}

void checkMagic(const ByteSource& source) {
  const auto n = std::min<std::uint64_t>(source.size(), kMagic.size());
  const auto bytes = source.read(0, n);
  const auto magic = std::as_bytes(std::span(kMagic));
  const auto differs = std::mismatch(bytes.begin(), bytes.end(), magic.begin()).first;
  if (differs - bytes.begin() == std::ptrdiff_t(kMagic.size())) return;
  // The first five bytes name the format; the line ends after them show how a transfer changed
  // them.
  if (differs - bytes.begin() >= 5 && n == kMagic.size())
    throw BadInput(source.name() + ": damaged by a transfer as text: its line ends were changed");
  throw BadInput(source.name() + ": not an .esvr file");
}

Header readHeader(const ByteSource& source) {
  checkMagic(source);
  const auto bytes = source.read(0, kHeaderBytes);
  const auto afterMagic = std::span(bytes).subspan(kMagic.size());
  ByteReader in(afterMagic, source.name() + ": header");
  Header h;
  h.versionMajor = in.get<std::uint16_t>();
  h.versionMinor = in.get<std::uint16_t>();
  if (h.versionMajor != kVersionMajor)  // before the checksum, which may be elsewhere there
    throw BadInput(source.name() + ": " + versions(h.versionMajor, h.versionMinor));
  h.sections = in.get<std::uint32_t>();
  h.fileBytes = in.get<std::uint64_t>();
  h.tableOffset = in.get<std::uint64_t>();
  h.tableChecksum = in.get<std::uint64_t>();
  if (in.get<std::uint64_t>() != checksum(std::span(bytes).first(kHeaderChecksumAt)))
    in.fail("checksum does not match");
  return h;
}

void checkSize(const ByteSource& source, const Header& h) {
  if (source.size() == h.fileBytes) return;
  if (h.fileBytes == 0)
    throw BadInput(source.name() + ": not complete: the program that wrote it was interrupted");
  const bool shorter = source.size() < h.fileBytes;
  throw BadInput(source.name() + (shorter ? ": truncated: " : ": has bytes after its end: ") +
                 std::to_string(source.size()) + " bytes where its header says " +
                 std::to_string(h.fileBytes));
}

void checkTablePlace(const ByteSource& source, const Header& h) {
  const bool begins = h.tableOffset >= kHeaderBytes && h.tableOffset <= h.fileBytes &&
                      h.tableOffset % kAlignment == 0;
  if (!begins || h.sections > (h.fileBytes - h.tableOffset) / kEntryBytes)
    throw BadInput(source.name() + ": the section table (" + std::to_string(h.sections) +
                   " sections at byte " + std::to_string(h.tableOffset) +
                   ") does not lie in the file");
}

}  // namespace

Placement placementOf(const SectionEntry& e) {
  return {e.offset, e.storedBytes, e.rawBytes, e.checksum, e.id.kind, e.codec, e.flags};
}

std::string describe(const SectionId& id) {
  std::string text = nameOf(id.kind);
  if (id.grid != kNone) text += " of grid " + std::to_string(id.grid);
  if (id.chunk != kNone) text += ", chunk " + std::to_string(id.chunk);
  return text;
}

std::string versions(std::uint16_t versionMajor, std::uint16_t versionMinor) {
  const auto text = [](unsigned a, unsigned b) {
    return std::to_string(a) + "." + std::to_string(b);
  };
  return "format " + text(versionMajor, versionMinor) + ", this reader knows " +
         text(kVersionMajor, kVersionMinor);
}

std::string placeOf(const std::string& file, const SectionTable& table, std::size_t entry) {
  const auto& e = table.entries[entry];
  return file + ": section " + std::to_string(entry) + " (" + describe(e.id) + ", at byte " +
         std::to_string(e.offset) + ")";
}

std::vector<std::byte> encodeTable(const SectionTable& table) {
  ByteWriter rows;
  for (const auto& e : table.entries) putEntry(rows, e);

  ByteWriter out;
  out.putAll(kMagic);
  out.put(table.versionMajor);
  out.put(table.versionMinor);
  out.put(std::uint32_t(table.entries.size()));
  out.put(table.fileBytes);
  out.put(table.tableOffset);
  out.put(checksum(rows.bytes()));
  out.put(checksum(out.bytes()));
  out.putAll(rows.bytes());
  return out.take();
}

SectionTable readTable(const ByteSource& source) {
  const Header h = readHeader(source);
  checkSize(source, h);
  checkTablePlace(source, h);
  const auto rows = source.read(h.tableOffset, h.sections * kEntryBytes);
  ByteReader in(rows, source.name() + ": section table");
  if (checksum(rows) != h.tableChecksum) in.fail("checksum does not match");

  SectionTable table{h.versionMajor, h.versionMinor, h.fileBytes, h.tableOffset, {}, false};
  for (std::uint32_t i = 0; i < h.sections; ++i) table.entries.push_back(getEntry(in));
  checkTable(source.name(), table);
  return table;
}

void forEachPiece(const ByteSource& source, const SectionEntry& entry,
                  const std::function<void(std::span<const std::byte>)>& use) {
  constexpr std::uint64_t kPieceBytes = 1 << 20;
  const std::uint64_t end = entry.offset + entry.storedBytes;
  for (std::uint64_t at = entry.offset; at < end; at += std::min(kPieceBytes, end - at)) {
    throwIfCancelled();
    use(source.read(at, std::min(kPieceBytes, end - at)));
  }
}

void checkStored(const ByteSource& source, const SectionTable& table, std::size_t entry) {
  RunningChecksum sum;
  forEachPiece(source, table.entries[entry], [&](auto piece) { sum.add(piece); });
  if (sum.value() != table.entries[entry].checksum)
    throw BadInput(placeOf(source.name(), table, entry) + ": checksum does not match");
}

std::vector<std::byte> readStored(const ByteSource& source, const SectionTable& table,
                                  std::size_t entry) {
  const auto& e = table.entries[entry];
  auto stored = source.read(e.offset, e.storedBytes);
  if (checksum(stored) != e.checksum)
    throw BadInput(placeOf(source.name(), table, entry) + ": checksum does not match");
  return stored;
}

std::vector<std::byte> readSection(const ByteSource& source, const SectionTable& table,
                                   std::size_t entry) {
  const auto& e = table.entries[entry];
  return unpack(e.codec, readStored(source, table, entry), e.rawBytes,
                placeOf(source.name(), table, entry));
}

}  // namespace esvr::format
