#pragma once
/// Checks that the header, the section table and the bytes between the sections agree.

#include <string>

#include "format/byte_source.h"
#include "format/section_table.h"

namespace esvr::format {

/// Refuses sections that reach beyond the file, sections that overlap but are not stored alike, two
/// sections with the same id, unknown kinds that are required, unknown codecs, and impossible
/// sizes.
/// \throws BadInput
void checkTable(const std::string& file, const SectionTable& table);

/// Refuses what checkTable() refuses besides the places of the sections. \throws BadInput
void checkRows(const std::string& file, const SectionTable& table);

/// Refuses bytes that belong to no section and are not zero. \throws BadInput
void checkGaps(const ByteSource& source, const SectionTable& table);

}  // namespace esvr::format
