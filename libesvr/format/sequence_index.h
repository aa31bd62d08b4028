#pragma once
/// The index of a sequence: the directories of its groups, in a section at the end of the file.

#include <cstdint>
#include <vector>

#include "format/byte_source.h"
#include "format/frame_group.h"
#include "format/section_table.h"

namespace esvr::format {

/// The first group begins after the header, and every other one where the one before it ends.
inline constexpr std::uint64_t kFirstGroupAt = kHeaderBytes;

/// The offset at which the next group begins.
[[nodiscard]] std::uint64_t endOf(const std::vector<FrameGroup>& groups);

/// The header of a file that is not complete. It says that the file has no sections and no bytes.
[[nodiscard]] std::vector<std::byte> partialHeader();

/// The complete end of a file, and the header that makes it valid.
struct SequenceEnd {
  std::vector<std::byte> header;
  std::vector<std::byte> bytes;  ///< the index and the section table, from endOf(groups) on
};
[[nodiscard]] SequenceEnd encodeEnd(const std::vector<FrameGroup>& groups);

/// True if the table is that of a sequence.
[[nodiscard]] bool isSequence(const SectionTable& table);

/// Reads the groups of a complete file from its index.
/// \throws BadInput  the file holds no sequence, or is damaged
[[nodiscard]] std::vector<FrameGroup> readGroups(const ByteSource& source);

/// Finds the complete groups of a partial file, whose frames have correct checksums.
/// \throws BadInput  the header is not partialHeader(), and not that of a complete file either
[[nodiscard]] std::vector<FrameGroup> findGroups(const ByteSource& source);

}  // namespace esvr::format
