// Checks of files and of sequences, which read everything and keep nothing.

#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/sequence_file.h"
#include "format/bytes.h"
#include "format/frame_table.h"
#include "format/records.h"
#include "format/sequence_file.h"

namespace esvr {

// ---- Files

namespace {

using namespace format;

void noteVersion(const SectionTable& table, std::vector<std::string>& notes) {
  if (table.versionMinor > kVersionMinor)
    notes.push_back("newer than this reader: " + versions(table.versionMajor, table.versionMinor));
}

void noteSkipped(const SectionTable& table, std::vector<std::string>& notes) {
  for (const auto& e : table.entries)
    if (!known(e.id.kind))
      notes.push_back("skipped: section " + describe(e.id) + ", " + std::to_string(e.storedBytes) +
                      " bytes");
}

/// Readers of voxels need no map, but no VDB file can be made with one that is damaged.
void requireMaps(const EsvrFile& content, const std::string& file) {
  const auto names = namesOfStored(content);
  for (std::size_t g = 0; g < content.grids.size(); ++g)
    if (const auto fault = mapFaultOf(content.grids[g].descriptor.transform))
      throw BadInput(file + ": grid '" + names[g] + "': " + fault->text);
}

void noteGrid(const StoredGrid& grid, const std::string& unique, std::vector<std::string>& notes) {
  const std::string name = "grid '" + unique + "'";
  if (grid.field.ellipsoidCount() == 0)
    notes.push_back(name +
                    (grid.voxels ? " holds voxels and no ellipsoids" : " has no ellipsoids"));
  if (!grid.farBackground && float(grid.descriptor.background) != grid.field.background)
    notes.push_back(name + " has one background in its descriptor and another in its field");
}

void noteCarried(const CarriedGrid& grid, std::vector<std::string>& notes) {
  notes.push_back("grid '" + shownName(grid.name) + "' is carried unchanged (" +
                  shownName(grid.treeType) + ")");
}

/// The file without its carried grids, whose bytes are not decoded.
std::vector<std::byte> encodedWithoutCarried(EsvrFile file) {
  file.carried.clear();
  return encodeEsvr(file);
}

}  // namespace

std::vector<std::string> checkEsvr(const std::filesystem::path& path, const ReadLimits& allowed) {
  ReadLimits limits = allowed;
  limits.carriedBytes = false;  // they are checked, but not kept
  const auto table = readAllRows(FileSource(path));
  const EsvrFile file = readEsvr(path, limits);
  if (encodedWithoutCarried(file) != encodedWithoutCarried(readEsvr(path, limits)))
    throw BadInput(path.string() + ": decoding it twice gives two contents");

  std::vector<std::string> notes;
  noteVersion(table, notes);
  noteSkipped(table, notes);
  requireMaps(file, path.string());
  const auto names = namesOfStored(file);
  for (std::size_t g = 0; g < file.grids.size(); ++g) noteGrid(file.grids[g], names[g], notes);
  for (const auto& grid : file.carried) noteCarried(grid, notes);
  return notes;
}

// ---- Sequences

namespace {

/// Verifies the bytes of a file that belong to no frame.
class GapCheck {
 public:
  GapCheck(const ByteSource& source, std::vector<SequenceFault>& faults)
      : source_(source), faults_(faults) {}

  void checkGroup(const FrameGroup& group) {
    const auto offsets = frameOffsets(group);
    checkDirectory(group);
    checkZero(group.offset + directoryBytes(group.frames.size()), offsets.front());
    for (std::size_t i = 0; i < group.frames.size(); ++i)
      checkZero(offsets[i] + group.frames[i].bytes, offsets[i + 1]);
  }

  /// Checks the bytes between the sections after the groups.
  void checkEnd(std::uint64_t end) {
    const SectionTable table = readTable(source_);
    checkZero(end + table.entries.front().storedBytes, table.tableOffset);
  }

 private:
  void checkDirectory(const FrameGroup& group) try {
    if (readDirectory(source_, group.offset).frames != group.frames)
      throw BadInput(source_.name() + ": the directory of the group at byte " +
                     std::to_string(group.offset) + " is not that of the index");
  } catch (const BadInput& fault) {
    faults_.push_back({std::nullopt, fault.what()});
  }

  void checkZero(std::uint64_t begin, std::uint64_t end) try {
    format::checkZero(source_, begin, end);
  } catch (const BadInput& fault) {
    faults_.push_back({std::nullopt, fault.what()});
  }

  const ByteSource& source_;
  std::vector<SequenceFault>& faults_;
};

}  // namespace

std::vector<SequenceFault> checkSequence(const std::filesystem::path& path,
                                         const ReadLimits& allowed) {
  ReadLimits limits = allowed;
  limits.carriedBytes = false;  // they are checked, but not kept
  std::vector<SequenceFault> faults;
  SequenceReader reader(path, limits);
  for (const SequenceFrame& frame : reader.frames()) try {
      requireMaps(reader.read(frame.number), frameName(path.string(), frame.number));
    } catch (const BadInput& fault) {
      faults.push_back({frame.number, fault.what()});
    }
  const FileSource source(path);
  const auto groups = readGroups(source);
  GapCheck gaps(source, faults);
  for (const FrameGroup& group : groups) gaps.checkGroup(group);
  gaps.checkEnd(endOf(groups));
  return faults;
}

}  // namespace esvr
