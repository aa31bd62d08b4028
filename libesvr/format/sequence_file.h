#pragma once
/// The frames of a sequence in its file: the directory of a group of frames, which precedes the frames, and the index,
/// which repeats the directories of all groups in a section at the end of the file.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "esvr/sequence_file.h"
#include "format/bytes.h"
#include "format/section_table.h"

namespace esvr::format {

// ---- Groups

struct FrameEntry {
  std::int64_t number = 0;
  std::uint64_t bytes = 0, checksum = 0;
  bool dependsOnPrevious = false;
  friend bool operator==(const FrameEntry&, const FrameEntry&) = default;
};
inline constexpr std::uint64_t kFrameEntryBytes = 28;

struct FrameGroup {
  std::uint64_t offset = 0;  ///< where its directory begins in the file
  std::vector<FrameEntry> frames;
};

/// Bytes of the directory of a group of n frames, with its checksum.
[[nodiscard]] std::uint64_t directoryBytes(std::uint64_t frames);

/// The offsets of the frames in the file, and after them that of the end of the group.
[[nodiscard]] std::vector<std::uint64_t> frameOffsets(const FrameGroup& group);
[[nodiscard]] std::uint64_t endOf(const FrameGroup& group);

/// Writes the number of frames and their entries.
void putFrames(ByteWriter& out, const std::vector<FrameEntry>& frames);

/// Reads them again.
/// \param end  offset at which the groups of the file end
/// \throws BadInput  the group is empty, its numbers do not increase, its first frame refers to
///                   another one, or it does not end before `end`
[[nodiscard]] FrameGroup getFrames(ByteReader& in, std::uint64_t offset, std::uint64_t end);

/// The directory with its checksum.
[[nodiscard]] std::vector<std::byte> encodeDirectory(const FrameGroup& group);

/// Reads the directory at an offset and verifies it. \throws BadInput
[[nodiscard]] FrameGroup readDirectory(const ByteSource& source, std::uint64_t offset);

/// Reads the bytes of a frame and verifies their checksum.
/// \throws BadInput  the text names the frame
[[nodiscard]] std::vector<std::byte> readFrame(const ByteSource& source, const FrameGroup& group,
                                               std::size_t frame);

/// The start of error texts about a frame: "file: frame 7".
[[nodiscard]] std::string frameName(const std::string& file, std::int64_t number);

/// The frames of all groups.
[[nodiscard]] std::vector<SequenceFrame> framesOf(const std::vector<FrameGroup>& groups);

// ---- The index

/// The first group begins after the header, and every other one where the one before it ends.
inline constexpr std::uint64_t kFirstGroupAt = kHeaderBytes;

/// The offset at which the next group begins.
[[nodiscard]] std::uint64_t endOf(const std::vector<FrameGroup>& groups);

/// The header of a file that is not complete. It says that the file has no sections and no bytes, and
/// has SequenceWriteOptions::origin in the place of the offset of the table.
[[nodiscard]] std::vector<std::byte> partialHeader(std::uint64_t origin);

/// The complete end of a file, and the header that makes it valid.
struct SequenceEnd {
  std::vector<std::byte> header;
  std::vector<std::byte> bytes;  ///< the index and the section table, from endOf(groups) on
};
[[nodiscard]] SequenceEnd encodeEnd(const std::vector<FrameGroup>& groups);

/// Reads the groups of a complete file from its index.
/// \throws BadInput  the file holds no sequence, or is damaged
[[nodiscard]] std::vector<FrameGroup> readGroups(const ByteSource& source);

/// Finds the complete groups of a partial file, whose frames have correct checksums.
/// \throws BadInput  the header is not partialHeader(), and not that of a complete file either
/// \throws UsageError  it is that of another origin
[[nodiscard]] std::vector<FrameGroup> findGroups(const ByteSource& source, std::uint64_t origin);

}  // namespace esvr::format
