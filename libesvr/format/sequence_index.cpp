// The directories of groups of frames, and the index of a sequence.

#include "format/sequence_index.h"

#include <algorithm>

namespace esvr::format {

// ---- Groups

namespace {

constexpr std::uint32_t kDepends = 1;  ///< the frame refers to the frame before it

FrameEntry getFrame(ByteReader& in) {
  FrameEntry entry;
  entry.number = in.get<std::int64_t>();
  entry.bytes = in.get<std::uint64_t>();
  entry.checksum = in.get<std::uint64_t>();
  const auto flags = in.get<std::uint32_t>();
  if (flags & ~kDepends) in.fail("unknown flags " + std::to_string(flags) + " of a frame");
  entry.dependsOnPrevious = flags == kDepends;
  return entry;
}

void checkFrame(const ByteReader& in, const FrameGroup& group, const FrameEntry& entry) {
  if (group.frames.empty() && entry.dependsOnPrevious)
    in.fail("the first frame of a group refers to another one");
  if (!group.frames.empty() && entry.number <= group.frames.back().number)
    in.fail("the numbers of the frames do not increase");
}

}  // namespace

std::uint64_t directoryBytes(std::uint64_t frames) {
  return sizeof(std::uint32_t) + frames * kFrameEntryBytes + sizeof(std::uint64_t);
}

std::vector<std::uint64_t> frameOffsets(const FrameGroup& group) {
  std::vector<std::uint64_t> offsets{alignUp(group.offset + directoryBytes(group.frames.size()))};
  for (const FrameEntry& entry : group.frames)
    offsets.push_back(alignUp(offsets.back() + entry.bytes));
  return offsets;
}

std::uint64_t endOf(const FrameGroup& group) { return frameOffsets(group).back(); }

void putFrames(ByteWriter& out, const std::vector<FrameEntry>& frames) {
  out.put(std::uint32_t(frames.size()));
  for (const FrameEntry& entry : frames) {
    out.put(entry.number);
    out.put(entry.bytes);
    out.put(entry.checksum);
    out.put(entry.dependsOnPrevious ? kDepends : 0u);
  }
}

FrameGroup getFrames(ByteReader& in, std::uint64_t offset, std::uint64_t end) {
  FrameGroup group{offset, {}};
  const auto count = in.get<std::uint32_t>();
  if (count == 0) in.fail("a group has no frame");
  if (count > in.left() / kFrameEntryBytes) in.fail("ends within the entries of frames");
  std::uint64_t at = alignUp(offset + directoryBytes(count));
  for (std::uint32_t i = 0; i < count; ++i) {
    const FrameEntry entry = getFrame(in);
    checkFrame(in, group, entry);
    if (at > end || entry.bytes > end - at) in.fail("a frame does not lie in the file");
    at = alignUp(at + entry.bytes);
    group.frames.push_back(entry);
  }
  return group;
}

std::vector<std::byte> encodeDirectory(const FrameGroup& group) {
  ByteWriter out;
  putFrames(out, group.frames);
  out.put(checksum(out.bytes()));
  return out.take();
}

FrameGroup readDirectory(const ByteSource& source, std::uint64_t offset) {
  const std::string where =
      source.name() + ": directory of the group at byte " + std::to_string(offset);
  const auto start = source.read(offset, sizeof(std::uint32_t));
  ByteReader length(start, where);
  const auto count = length.get<std::uint32_t>();
  const auto bytes = source.read(offset, directoryBytes(count));
  const std::span<const std::byte> all(bytes);
  const auto content = all.first(all.size() - sizeof(std::uint64_t));
  ByteReader sum(all.last(sizeof(std::uint64_t)), where);
  if (sum.get<std::uint64_t>() != checksum(content)) sum.fail("checksum does not match");
  ByteReader in(content, where);
  return getFrames(in, offset, source.size());
}

std::vector<std::byte> readFrame(const ByteSource& source, const FrameGroup& group,
                                 std::size_t frame) {
  const FrameEntry& entry = group.frames[frame];
  auto bytes = source.read(frameOffsets(group)[frame], entry.bytes);
  if (checksum(bytes) != entry.checksum)
    throw BadInput(frameName(source.name(), entry.number) + ": checksum does not match");
  return bytes;
}

std::string frameName(const std::string& file, std::int64_t number) {
  return file + ": frame " + std::to_string(number);
}

std::vector<SequenceFrame> framesOf(const std::vector<FrameGroup>& groups) {
  std::vector<SequenceFrame> frames;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto offsets = frameOffsets(groups[g]);
    for (std::size_t i = 0; i < groups[g].frames.size(); ++i) {
      const FrameEntry& entry = groups[g].frames[i];
      frames.push_back({entry.number, g, offsets[i], entry.bytes, entry.dependsOnPrevious});
    }
  }
  return frames;
}

// ---- The index

namespace {

SectionTable emptyTable() {
  SectionTable table;
  table.versionMinor = minorVersionOf(SectionKind::kSequenceIndex);
  return table;
}

std::vector<std::byte> encodeIndex(const std::vector<FrameGroup>& groups) {
  ByteWriter out;
  out.put(std::uint32_t(groups.size()));
  for (const FrameGroup& group : groups) putFrames(out, group.frames);
  return out.take();
}

SectionTable tableFor(std::uint64_t offset, std::span<const std::byte> index) {
  SectionEntry entry{{SectionKind::kSequenceIndex}, Codec::kRaw, kRequired, offset, 0, 0, 0};
  entry.storedBytes = entry.rawBytes = index.size();
  entry.checksum = checksum(index);
  SectionTable table = emptyTable();
  table.tableOffset = alignUp(offset + index.size());
  table.fileBytes = table.tableOffset + kEntryBytes;
  table.entries = {entry};
  return table;
}

std::size_t indexIn(const ByteSource& source, const SectionTable& table) {
  if (!isSequence(table)) throw BadInput(source.name() + ": holds no sequence");
  if (table.entries.size() != 1)
    throw BadInput(source.name() + ": holds other sections besides the index of a sequence");
  return 0;
}

/// A complete group at an offset. \throws BadInput  there is none
FrameGroup completeGroup(const ByteSource& source, std::uint64_t offset) {
  FrameGroup group = readDirectory(source, offset);
  for (std::size_t i = 0; i < group.frames.size(); ++i) (void)readFrame(source, group, i);
  if (endOf(group) > source.size()) throw BadInput(source.name() + ": a group is not complete");
  return group;
}

void requireIncreasing(const ByteReader& in, const std::vector<FrameGroup>& groups,
                       const FrameGroup& next) {
  if (!groups.empty() && next.frames.front().number <= groups.back().frames.back().number)
    in.fail("the numbers of the frames do not increase");
}

}  // namespace

std::uint64_t endOf(const std::vector<FrameGroup>& groups) {
  return groups.empty() ? kFirstGroupAt : endOf(groups.back());
}

std::vector<std::byte> partialHeader() { return encodeTable(emptyTable()); }

SequenceEnd encodeEnd(const std::vector<FrameGroup>& groups) {
  const std::uint64_t offset = endOf(groups);
  const auto index = encodeIndex(groups);
  const SectionTable table = tableFor(offset, index);
  const auto headerAndRows = encodeTable(table);
  const auto header = std::span(headerAndRows).first(kHeaderBytes);
  ByteWriter end;
  end.putAll(index);
  end.padTo(table.tableOffset - offset);
  end.putAll(std::span(headerAndRows).subspan(kHeaderBytes));
  return {{header.begin(), header.end()}, end.take()};
}

std::vector<FrameGroup> readGroups(const ByteSource& source) {
  const SectionTable table = readTable(source);
  const std::size_t entry = indexIn(source, table);
  const auto content = readSection(source, table, entry);
  ByteReader in(content, placeOf(source.name(), table, entry));
  std::vector<FrameGroup> groups;
  for (auto left = in.get<std::uint32_t>(); left > 0; --left) {
    FrameGroup group = getFrames(in, endOf(groups), table.entries[entry].offset);
    requireIncreasing(in, groups, group);
    groups.push_back(std::move(group));
  }
  in.finish();
  if (endOf(groups) != table.entries[entry].offset)
    in.fail("the groups do not end where the index begins");
  return groups;
}

std::vector<FrameGroup> findGroups(const ByteSource& source) {
  const auto expected = partialHeader();
  const auto header = source.read(0, std::min<std::uint64_t>(source.size(), kHeaderBytes));
  // A process may have been killed between writing the final header and renaming the file.
  if (header != expected) return readGroups(source);
  std::vector<FrameGroup> groups;
  try {
    for (;;) groups.push_back(completeGroup(source, endOf(groups)));
  } catch (const BadInput&) {
    return groups;  // the bytes behind them are not a complete group
  }
}

}  // namespace esvr::format
