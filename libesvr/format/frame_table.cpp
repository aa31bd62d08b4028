// The short form of a table, of frames and of packed sections.

#include "format/frame_table.h"

#include <algorithm>
#include <utility>

#include "esvr/error.h"

namespace esvr::format {

namespace {

constexpr std::uint8_t kMetadata = 1, kVectors = 2, kCarried = 4, kAllParts = 7;
constexpr std::uint16_t kMinorVersion = 3;
constexpr std::size_t kFrameSumBytes = sizeof(std::uint64_t);

std::uint8_t bitsOf(const Inherited& inherited) {
  return std::uint8_t((inherited.metadata ? kMetadata : 0) | (inherited.vectors ? kVectors : 0) |
                      (inherited.carried ? kCarried : 0));
}

Inherited getInherited(ByteReader& in) {
  const auto bits = in.get<std::uint8_t>();
  if (bits > kAllParts) in.fail("unknown parts of the frame before: " + std::to_string(bits));
  return {(bits & kMetadata) != 0, (bits & kVectors) != 0, (bits & kCarried) != 0};
}

/// kNone becomes 0, so that it takes one byte.
void putIndex(ByteWriter& out, std::uint32_t index) { putVarint(out, std::uint32_t(index + 1)); }

std::uint32_t getNumber(ByteReader& in) {
  const std::uint64_t value = getVarint(in);
  if (value > 0xffffffffu) in.fail("a number has more than 32 bits");
  return std::uint32_t(value);
}
std::uint32_t getIndex(ByteReader& in) { return getNumber(in) - 1; }

void putRow(ByteWriter& out, const SectionEntry& row, std::size_t content) {
  putVarint(out, std::uint32_t(row.id.kind));
  putIndex(out, row.id.grid);
  putIndex(out, row.id.chunk);
  putVarint(out, row.flags);
  putVarint(out, content);
}

void putSizes(ByteWriter& out, const SectionEntry& row) {
  putVarint(out, std::uint32_t(row.codec));
  putVarint(out, row.storedBytes);
  if (row.codec != Codec::kRaw) putVarint(out, row.rawBytes);
}

class FrameReader {
 public:
  FrameReader(std::span<const std::byte> bytes, const std::string& name)
      : name_(name), bytes_(bytes), in_(bytes.first(bytes.size() - kFrameSumBytes), name) {}

  FrameTable read() {
    if (std::byte(in_.get<std::uint8_t>()) != kFrameMark) in_.fail("no mark of a frame");
    FrameTable table{getInherited(in_), {kVersionMajor, kMinorVersion, bytes_.size(), 0, {}, true}};
    getRows(table.sections);
    getSizes();
    placeContents();
    for (std::size_t i = 0; i < contentOf_.size(); ++i) place(i, table.sections.entries[i]);
    checkRows(name_, table.sections);
    return table;
  }

 private:
  void getRows(SectionTable& table) {
    const std::uint64_t rows = getVarint(in_);
    for (std::uint64_t i = 0; i < rows; ++i) {
      SectionEntry row;
      row.id.kind = SectionKind(getNumber(in_));
      row.id.grid = getIndex(in_);
      row.id.chunk = getIndex(in_);
      row.flags = std::uint16_t(std::min<std::uint32_t>(getNumber(in_), 0xffff));
      contentOf_.push_back(getContent());
      table.entries.push_back(row);
    }
  }
  /// The index of a row's content, which is that of a row before or the next new one.
  std::size_t getContent() {
    const std::uint64_t content = getVarint(in_);
    if (content > contents_.size()) in_.fail("a section has no content");
    if (content == contents_.size()) contents_.emplace_back();
    return std::size_t(content);
  }
  void getSizes() {
    for (SectionEntry& content : contents_) {
      content.codec = Codec(std::uint16_t(std::min<std::uint32_t>(getNumber(in_), 0xffff)));
      content.storedBytes = getVarint(in_);
      content.rawBytes = content.codec == Codec::kRaw ? content.storedBytes : getVarint(in_);
    }
  }
  void placeContents() {
    for (SectionEntry& content : contents_) {
      content.offset = bytes_.size() - kFrameSumBytes - in_.left();
      if (content.storedBytes > in_.left()) in_.fail("sections do not lie in the frame");
      content.checksum = checksum(in_.getBytes(content.storedBytes));
    }
    in_.finish();
  }
  void place(std::size_t row, SectionEntry& entry) const {
    const SectionEntry& content = contents_[contentOf_[row]];
    entry.codec = content.codec;
    entry.offset = content.offset;
    entry.storedBytes = content.storedBytes, entry.rawBytes = content.rawBytes;
    entry.checksum = content.checksum;
  }

  const std::string& name_;
  std::span<const std::byte> bytes_;
  ByteReader in_;
  std::vector<SectionEntry> contents_;  ///< their ids are not used
  std::vector<std::size_t> contentOf_;
};

}  // namespace

std::vector<std::byte> putFrame(const FrameTable& table, const FrameContents& contents) {
  const auto& rows = table.sections.entries;
  ByteWriter out, sizes;
  out.put(std::uint8_t(kFrameMark));
  out.put(bitsOf(table.inherited));
  putVarint(out, rows.size());
  std::size_t known = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    putRow(out, rows[i], contents.contentOf[i]);
    if (contents.contentOf[i] == known) putSizes(sizes, rows[i]), ++known;
  }
  out.putAll(sizes.bytes());
  for (const auto& content : contents.contents) out.putAll(content);
  out.put(checksum(out.bytes()));
  return out.take();
}

bool isShortFrame(std::span<const std::byte> bytes) {
  return !bytes.empty() && bytes.front() == kFrameMark;
}

FrameTable getFrame(std::span<const std::byte> bytes, const std::string& name) {
  if (bytes.size() < kFrameSumBytes + 2) throw BadInput(name + ": the frame is truncated");
  ByteReader end(bytes.last(kFrameSumBytes), name);
  if (checksum(bytes.first(bytes.size() - kFrameSumBytes)) != end.get<std::uint64_t>())
    throw BadInput(name + ": the checksum of the frame does not match");
  return FrameReader(bytes, name).read();
}

// ---- Packed sections

namespace {

/// The rows in the content of a packed section. Their offsets are those in the file.
std::vector<SectionEntry> rowsIn(const ByteSource& source, const SectionTable& table,
                                 std::size_t packed) {
  const std::string place = placeOf(source.name(), table, packed);
  const SectionEntry& entry = table.entries[packed];
  if (entry.codec != Codec::kRaw) throw BadInput(place + ": must not be compressed");
  FrameTable content = getFrame(readStored(source, table, packed), place);
  if (content.inherited != Inherited{}) throw BadInput(place + ": refers to another frame");
  for (SectionEntry& row : content.sections.entries) row.offset += entry.offset;
  return std::move(content.sections.entries);
}

}  // namespace

void addPackedRows(const ByteSource& source, SectionTable& table) {
  const auto isPacked = [](const SectionEntry& entry) {
    return entry.id == SectionId{SectionKind::kPacked};
  };
  const auto packed = std::ranges::find_if(table.entries, isPacked);
  if (packed == table.entries.end()) return;
  const auto rows = rowsIn(source, table, std::size_t(packed - table.entries.begin()));
  table.entries.insert(table.entries.end(), rows.begin(), rows.end());
  checkRows(source.name(), table);
}

SectionTable readAllRows(const ByteSource& source) {
  SectionTable table = readTable(source);
  addPackedRows(source, table);
  return table;
}

}  // namespace esvr::format
