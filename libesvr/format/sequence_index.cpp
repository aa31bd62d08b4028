#include "format/sequence_index.h"

#include <algorithm>

#include "format/checksum.h"

namespace esvr::format {
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

bool isSequence(const SectionTable& table) {
  return std::ranges::any_of(table.entries, [](const SectionEntry& entry) {
    return entry.id.kind == SectionKind::kSequenceIndex;
  });
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
