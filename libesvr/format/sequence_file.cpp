// Sequences: the directories of groups of frames, the index, frames as differences from the previous ones, the reader of their file, and its writer.

#include "format/sequence_file.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/atomic_file.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "format/frame_table.h"
#include "format/section_reader.h"
#include "format/section_writer.h"

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

std::vector<std::byte> partialHeader(std::uint64_t origin) {
  SectionTable table = emptyTable();
  table.tableOffset = origin;
  return encodeTable(table);
}

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

namespace {

/// True for the partial header of any origin.
bool isPartialHeader(const std::vector<std::byte>& header) {
  constexpr std::size_t kOriginAt =
      kMagic.size() + 2 * sizeof(std::uint16_t) + sizeof(std::uint32_t) + sizeof(std::uint64_t);
  if (header.size() < kHeaderBytes) return false;
  const auto rest = std::span(header).subspan(kOriginAt);
  ByteReader in(rest, "header");
  return header == partialHeader(in.get<std::uint64_t>());
}

}  // namespace

std::vector<FrameGroup> findGroups(const ByteSource& source, std::uint64_t origin) {
  const auto header = source.read(0, std::min<std::uint64_t>(source.size(), kHeaderBytes));
  if (header != partialHeader(origin)) {
    if (isPartialHeader(header))
      throw UsageError(source.name() + " was begun with other options or by another version");
    // A process may have been killed between writing the final header and renaming the file.
    return readGroups(source);
  }
  std::vector<FrameGroup> groups;
  try {
    for (;;) groups.push_back(completeGroup(source, endOf(groups)));
  } catch (const BadInput&) {
    return groups;  // the bytes behind them are not a complete group
  }
}

}  // namespace esvr::format

// ---- Reading and writing

namespace esvr {
namespace {

using namespace format;

}  // namespace

// ---- Frames

bool haveSameGrids(const EsvrFile& a, const EsvrFile& b) {
  const auto areAlike = [](const StoredGrid& grid, const StoredGrid& other) {
    const GridDescriptor &x = grid.descriptor, &y = other.descriptor;
    return x.name == y.name && x.gridClass == y.gridClass && x.valueType == y.valueType &&
           x.transform == y.transform;
  };
  const auto areAlikeCarried = [](const CarriedGrid& x, const CarriedGrid& y) {
    return x.name == y.name && x.treeType == y.treeType && x.place == y.place;
  };
  return std::ranges::equal(a.grids, b.grids, areAlike) &&
         std::ranges::equal(a.carried, b.carried, areAlikeCarried) && a.vectors == b.vectors;
}

std::vector<std::byte> encodeFrame(const EsvrFile& frame, const EsvrFile* previous) {
  if (previous)
    if (auto differences = differencesOf(frame, *previous))
      return differences->sections.assembleFrame(differences->inherited);
  return encodeEsvr(frame);
}

EsvrFile decodeFrame(std::span<const std::byte> bytes, const std::string& nameForErrors,
                     const ReadLimits& limits, const EsvrFile* previous) {
  if (!isShortFrame(bytes)) return decodeEsvr(bytes, nameForErrors, limits);
  if (!previous) throw BadInput(nameForErrors + ": it cannot be read without the frame before");
  return decodeShort(bytes, nameForErrors, limits, *previous);
}

bool dependsOnPrevious(std::span<const std::byte> bytes) {
  if (isShortFrame(bytes)) return true;
  (void)readTable(MemorySource(bytes, "frame"));
  return false;
}

std::uint64_t bytesInFrame(const StoredGrid& grid, const StoredGrid* previous) {
  const std::uint64_t nonFinite = bytesOfNonFinite(grid);
  const std::uint64_t own = bytesAdded(grid) - nonFinite;
  if (previous)
    if (const auto difference = differenceOf(grid, *previous, own)) {
      const bool isSame = previous->nonFiniteVoxels == grid.nonFiniteVoxels;
      return difference->size() + kFrameRowBytes + (isSame ? 0 : nonFinite);
    }
  return own + nonFinite;
}

// ---- The reader

bool holdsSequence(const std::filesystem::path& path) {
  return isSequence(readTable(FileSource(path)));
}

class SequenceReader::File {
 public:
  File(const std::filesystem::path& path, const ReadLimits& limits)
      : source_(path), limits_(limits), groups_(readGroups(source_)), frames_(framesOf(groups_)) {
    for (const FrameGroup& group : groups_) {
      firstOf_.push_back(frameCount_);
      frameCount_ += group.frames.size();
    }
  }

  [[nodiscard]] const std::vector<SequenceFrame>& frames() const { return frames_; }
  [[nodiscard]] std::size_t groupCount() const { return groups_.size(); }
  [[nodiscard]] std::uint64_t fileBytes() const { return source_.size(); }
  [[nodiscard]] std::uint64_t bytesRead() const { return source_.bytesRead(); }

  const EsvrFile& read(std::int64_t number) {
    const std::size_t wanted = indexOf(number);
    for (std::size_t i = firstToDecode(wanted); i <= wanted; ++i) decode(i);
    return *decoded_;
  }

  [[nodiscard]] EsvrSummary inspect(std::int64_t number) const {
    return inspectEsvr(bytesOf(indexOf(number)), frameName(source_.name(), number));
  }

  [[nodiscard]] EsvrFile propertiesOfFirst() const {
    if (frames_.empty()) return {};
    ReadPart wanted{.limits = limits_};
    wanted.grids.emplace();
    const auto bytes = bytesOf(0);
    const std::string name = frameName(source_.name(), frames_.front().number);
    return decodePart(MemorySource(bytes, name), wanted).file;
  }

 private:
  [[nodiscard]] std::size_t indexOf(std::int64_t number) const {
    const auto at = std::ranges::lower_bound(frames_, number, {}, &SequenceFrame::number);
    if (at == frames_.end() || at->number != number)
      throw BadInput(source_.name() + ": there is no frame " + std::to_string(number));
    return std::size_t(at - frames_.begin());
  }

  /// The frame after the one that was decoded last, if that helps to decode the wanted one;
  /// otherwise the last frame up to the wanted one that refers to no other.
  [[nodiscard]] std::size_t firstToDecode(std::size_t wanted) const {
    std::size_t first = wanted;
    while (frames_[first].dependsOnPrevious && lastDecoded_ != first) --first;
    return lastDecoded_ == first ? first + 1 : first;
  }

  [[nodiscard]] std::vector<std::byte> bytesOf(std::size_t i) const {
    const std::size_t group = frames_[i].group;
    return readFrame(source_, groups_[group], i - firstOf_[group]);
  }

  /// A frame that cannot be decoded leaves none, because it may need the one before it again.
  void decode(std::size_t i) {
    lastDecoded_.reset();
    const bool depends = frames_[i].dependsOnPrevious;
    if (!depends) decoded_.reset();
    // Both frames are in memory until the new one is complete.
    ReadLimits left = limits_;
    if (depends && left.maxBytes != kNoMemoryLimit)
      left.maxBytes -= std::min(left.maxBytes, contentBytes(*decoded_));
    EsvrFile frame = decodeFrame(bytesOf(i), frameName(source_.name(), frames_[i].number), left,
                                 depends ? &*decoded_ : nullptr);
    decoded_ = std::move(frame);
    lastDecoded_ = i;
  }

  FileSource source_;
  ReadLimits limits_;
  std::vector<FrameGroup> groups_;
  std::vector<SequenceFrame> frames_;
  std::vector<std::size_t> firstOf_;  ///< index of the first frame of each group
  std::size_t frameCount_ = 0;
  std::optional<EsvrFile> decoded_;
  std::optional<std::size_t> lastDecoded_;  ///< index of the frame that is decoded
};

SequenceReader::SequenceReader(const std::filesystem::path& path, const ReadLimits& limits)
    : file_(std::make_unique<File>(path, limits)) {}
SequenceReader::~SequenceReader() = default;

const std::vector<SequenceFrame>& SequenceReader::frames() const { return file_->frames(); }
std::size_t SequenceReader::groupCount() const { return file_->groupCount(); }
std::uint64_t SequenceReader::fileBytes() const { return file_->fileBytes(); }
const EsvrFile& SequenceReader::read(std::int64_t number) { return file_->read(number); }
EsvrSummary SequenceReader::inspect(std::int64_t number) { return file_->inspect(number); }
EsvrFile SequenceReader::propertiesOfFirst() const { return file_->propertiesOfFirst(); }
std::uint64_t SequenceReader::bytesRead() const { return file_->bytesRead(); }

// ---- The writer

namespace {

PartialStart startOf(PartialSequence partial) {
  return partial == PartialSequence::kRefuse ? PartialStart::kRefuse : PartialStart::kContinue;
}

/// The file of that name may be somebody else's.
void requireOurs(const PartialFile& file, PartialSequence partial) {
  const FileSource source(file.path());
  const auto expected = std::as_bytes(std::span(kMagic));
  const auto begin = source.read(0, std::min<std::uint64_t>(source.size(), expected.size()));
  if (std::ranges::equal(begin, expected.first(begin.size()))) return;
  const std::string text = "cannot write " + file.path().string() +
                           ": it is there, and is no part of an .esvr file; remove it or rename it";
  if (partial == PartialSequence::kResume) throw BadInput(text);
  throw RuntimeFailure(text);
}

}  // namespace

class SequenceWriter::File {
 public:
  File(const std::filesystem::path& path, const SequenceWriteOptions& options)
      : name_(path.string()),
        origin_(options.origin),
        file_(path, options.overwrite, startOf(options.partial)) {
    requireOurs(file_, options.partial);
    if (options.partial == PartialSequence::kResume && file_.size() > kHeaderBytes)
      groups_ = findGroups(FileSource(file_.path()), origin_);
    dropGroups(groups_.size());
  }
  ~File() {
    if (groups_.empty() && !finished_) discard();
  }

  [[nodiscard]] const std::vector<SequenceFrame>& frames() const { return frames_; }
  [[nodiscard]] std::size_t groupCount() const { return groups_.size(); }

  /// Removes everything after the first n groups.
  void dropGroups(std::size_t n) {
    groups_.resize(std::min(n, groups_.size()));
    frames_ = framesOf(groups_);
    // The header comes first: a complete one must not stand before a shorter file.
    file_.replaceStart(partialHeader(origin_));
    file_.truncate(endOf(groups_));
    file_.flush();
  }

  void append(std::int64_t number, std::vector<std::byte> bytes) {
    const bool depends = dependsOnPrevious(bytes);
    if (const auto last = lastNumber(); last && number <= *last)
      refuse(number, "its number is not above " + std::to_string(*last));
    if (depends && entries_.empty())
      refuse(number, "it begins a group, but refers to another frame");
    entries_.push_back({number, bytes.size(), checksum(bytes), depends});
    contents_.push_back(std::move(bytes));
  }

  void endGroup() {
    if (entries_.empty()) return;
    FrameGroup group{endOf(groups_), std::exchange(entries_, {})};
    write(group, std::exchange(contents_, {}));
    groups_.push_back(std::move(group));
    const auto added = framesOf({groups_.back()});
    for (SequenceFrame frame : added) {
      frame.group = groups_.size() - 1;
      frames_.push_back(frame);
    }
  }

  std::uint64_t finish() {
    endGroup();
    if (groups_.empty()) throw RuntimeFailure("cannot write " + name_ + ": there is no frame");
    const SequenceEnd end = encodeEnd(groups_);
    file_.append(end.bytes);
    file_.flush();  // the header makes the file valid, and must not reach the disk before its end
    file_.replaceStart(end.header);
    const std::uint64_t bytes = file_.size();
    file_.commit();
    finished_ = true;
    return bytes;
  }

 private:
  [[noreturn]] void refuse(std::int64_t number, const std::string& why) const {
    throw UsageError(frameName(name_, number) + " cannot be appended: " + why);
  }

  [[nodiscard]] std::optional<std::int64_t> lastNumber() const {
    if (!entries_.empty()) return entries_.back().number;
    return frames_.empty() ? std::nullopt : std::optional(frames_.back().number);
  }

  /// Writes frame by frame, so that no second copy of the group is in memory.
  void write(const FrameGroup& group, const std::vector<std::vector<std::byte>>& contents) {
    const auto offsets = frameOffsets(group);
    const auto directory = encodeDirectory(group);
    appendPadded(directory, offsets.front() - group.offset);
    for (std::size_t i = 0; i < contents.size(); ++i)
      appendPadded(contents[i], offsets[i + 1] - offsets[i]);
    file_.flush();
  }

  void appendPadded(std::span<const std::byte> bytes, std::uint64_t size) {
    file_.append(bytes);
    file_.append(std::vector<std::byte>(size - bytes.size()));
  }

  /// Empties the file, so that nothing of it stays.
  void discard() noexcept try {
    file_.truncate(0);
  } catch (const Error&) {  // a header without groups stays, which a later run may continue
  }

  std::string name_;
  std::uint64_t origin_;
  PartialFile file_;
  std::vector<FrameGroup> groups_;
  std::vector<SequenceFrame> frames_;
  std::vector<FrameEntry> entries_;  ///< of the group that is not complete
  std::vector<std::vector<std::byte>> contents_;
  bool finished_ = false;
};

SequenceWriter::SequenceWriter(const std::filesystem::path& path,
                               const SequenceWriteOptions& options)
    : file_(std::make_unique<File>(path, options)) {}
SequenceWriter::~SequenceWriter() = default;

std::filesystem::path SequenceWriter::partialPath(const std::filesystem::path& path) {
  return PartialFile::pathFor(path);
}

const std::vector<SequenceFrame>& SequenceWriter::frames() const { return file_->frames(); }
std::size_t SequenceWriter::groupCount() const { return file_->groupCount(); }
void SequenceWriter::dropGroups(std::size_t group) { file_->dropGroups(group); }
void SequenceWriter::append(std::int64_t number, std::vector<std::byte> frame) {
  file_->append(number, std::move(frame));
}
void SequenceWriter::endGroup() { file_->endGroup(); }
std::uint64_t SequenceWriter::finish() { return file_->finish(); }

}  // namespace esvr
