#pragma once
/// The section that holds small sections, so that they need no rows of the section table
/// (docs/format.md, "Packed sections"). Its content has the short form of a frame.

#include <cstdint>

#include "format/byte_source.h"
#include "format/section_table.h"

namespace esvr::format {

/// Largest number of bytes of a section that is packed.
inline constexpr std::uint64_t kLargestPacked = 4096;

/// Adds the rows of packed sections to a table, if the file has any. The section that holds them is
/// read and verified.
/// \throws BadInput  it is damaged
void addPackedRows(const ByteSource& source, SectionTable& table);

/// The header and the section table of a file, and the rows of packed sections after its own.
/// \throws BadInput  as for readTable
[[nodiscard]] SectionTable readAllRows(const ByteSource& source);

}  // namespace esvr::format
