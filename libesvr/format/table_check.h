#pragma once
/// Checks that header, section table and the bytes around the sections agree.

#include <string>

#include "format/byte_source.h"
#include "format/section_table.h"

namespace esvr::format {

/// Refuses sections that lie outside the file or on each other, two of one id, kinds and codecs
/// that would have to be understood, sizes that cannot be. \throws BadInput
void checkTable(const std::string& file, const SectionTable& table);

/// Refuses bytes that belong to no section and are not zero. \throws BadInput
void checkGaps(const ByteSource& source, const SectionTable& table);

}  // namespace esvr::format
