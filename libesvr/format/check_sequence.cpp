#include <algorithm>

#include "esvr/error.h"
#include "esvr/sequence_file.h"
#include "format/byte_source.h"
#include "format/sequence_index.h"
#include "format/validity.h"

namespace esvr {
namespace {

using namespace format;

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

  void checkZero(std::uint64_t begin, std::uint64_t end) {
    const auto bytes = source_.read(begin, end - begin);
    const auto isZero = [](std::byte b) { return b == std::byte{}; };
    if (!std::ranges::all_of(bytes, isZero))
      faults_.push_back({std::nullopt, source_.name() + ": a byte between " +
                                           std::to_string(begin) + " and " + std::to_string(end) +
                                           " belongs to no part and is not zero"});
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
      for (const StoredGrid& grid : reader.read(frame.number).grids)
        if (const auto fault = mapFaultOf(grid.descriptor.transform))
          throw BadInput(frameName(path.string(), frame.number) + ": grid '" +
                         grid.descriptor.name + "': " + fault->text);
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
