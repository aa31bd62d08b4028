#pragma once
/// The directory of a group of frames, which precedes the frames. The index of the file repeats it.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "esvr/sequence_file.h"
#include "format/byte_reader.h"
#include "format/byte_source.h"
#include "format/byte_writer.h"

namespace esvr::format {

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

}  // namespace esvr::format
