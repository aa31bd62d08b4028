#include "format/section_reader.h"

#include <algorithm>
#include <set>

#include "esvr/error.h"
#include "format/frame_table.h"

namespace esvr::format {

namespace {

/// Largest number of bytes of memory that a byte of content becomes. An item of metadata may be
/// three lengths of four bytes each, and becomes three containers.
double expansionOf(SectionKind kind) {
  constexpr double kOfMetadata = 32.0, kOfArrays = 4.0;
  const bool hasMetadata = kind == SectionKind::kFileMetadata || kind == SectionKind::kGrid ||
                           kind == SectionKind::kGridRecords;
  return hasMetadata ? kOfMetadata : kOfArrays;
}

}  // namespace

SectionReader::SectionReader(const ByteSource& source, const ReadLimits& limits)
    : SectionReader(source, readTable(source), limits) {}

SectionReader::SectionReader(const ByteSource& source, SectionTable table, const ReadLimits& limits)
    : source_(source),
      table_(std::move(table)),
      ownRows_(table_.entries.size()),
      budget_(limits.maxBytes, limits.memory) {
  if (isSequence(table_))
    throw BadInput(source.name() + ": holds a sequence, whose frames are read one at a time");
  addPackedRows(source, table_);
  for (std::size_t i = 0; i < table_.entries.size(); ++i) unread_[table_.entries[i].id] = i;
  if (ownRows_ < table_.entries.size()) unread_.erase({SectionKind::kPacked});
}

std::uint32_t SectionReader::count(SectionKind kind) const {
  return std::uint32_t(std::count_if(table_.entries.begin(), table_.entries.end(),
                                     [kind](const auto& e) { return e.id.kind == kind; }));
}

std::string SectionReader::place(const SectionId& id) const {
  const auto& entries = table_.entries;
  const auto it =
      std::find_if(entries.begin(), entries.end(), [&](const auto& e) { return e.id == id; });
  if (it == entries.end()) return source_.name() + ": " + describe(id);
  return placeOf(source_.name(), table_, std::size_t(it - entries.begin()));
}

const SectionEntry& SectionReader::entryOf(const SectionId& id) const {
  const auto at = unread_.find(id);
  if (at == unread_.end()) throw BadInput(source_.name() + ": there is no " + describe(id));
  return table_.entries[at->second];
}

std::uint64_t SectionReader::storedBytes(const SectionId& id) const {
  return entryOf(id).storedBytes;
}

std::vector<std::byte> SectionReader::peek(const SectionId& id, std::uint64_t bytes) const {
  const SectionEntry& entry = entryOf(id);
  return source_.read(entry.offset, std::min(bytes, entry.storedBytes));
}

std::size_t SectionReader::take(const SectionId& id) {
  const auto node = unread_.extract(id);
  if (node.empty()) throw BadInput(source_.name() + ": there is no " + describe(id));
  return node.mapped();
}

std::vector<std::byte> SectionReader::get(const SectionId& id) {
  const std::size_t taken = take(id);
  const SectionEntry& entry = table_.entries[taken];
  budget_.take(double(entry.rawBytes) * expansionOf(id.kind),
               placeOf(source_.name(), table_, taken));
  return readSection(source_, table_, taken);
}

VoxelArray<std::byte> SectionReader::getCarried(const SectionId& id) {
  const std::size_t taken = take(id);
  const std::uint64_t bytes = table_.entries[taken].rawBytes;
  const VoxelMemory memory =
      budget_.takeVoxels(bytes, double(bytes), 0.0, placeOf(source_.name(), table_, taken));
  return readCarried(source_, table_, taken, memory);
}

void SectionReader::check(const SectionId& id) { checkStored(source_, table_, take(id)); }

std::unique_ptr<ByteSource> SectionReader::open(const SectionId& id, bool whole) {
  const std::size_t taken = take(id);
  const SectionEntry& entry = table_.entries[taken];
  const std::string name = placeOf(source_.name(), table_, taken);
  if (entry.codec != Codec::kRaw) throw BadInput(name + ": must not be compressed");
  if (whole) {
    budget_.take(double(entry.storedBytes), name);
    return std::make_unique<BufferSource>(readStored(source_, table_, taken), name);
  }
  return std::make_unique<PartSource>(source_, entry.offset, entry.storedBytes, name);
}

SectionTable SectionReader::ownTable() const {
  SectionTable own = table_;
  own.entries.resize(ownRows_);
  return own;
}

void SectionReader::finish() {
  if (!table_.isFrame) checkGaps(source_, ownTable());
  std::set<Placement> read;  // shared bytes are read once, however many sections share them
  for (const auto& [id, entry] : unread_) {
    if (known(id.kind))
      throw BadInput(placeOf(source_.name(), table_, entry) + ": belongs to nothing in the file");
    if (read.insert(placementOf(table_.entries[entry])).second) checkStored(source_, table_, entry);
  }
}

}  // namespace esvr::format
