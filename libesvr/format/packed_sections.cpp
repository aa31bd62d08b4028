#include "format/packed_sections.h"

#include <algorithm>

#include "esvr/error.h"
#include "format/frame_table.h"
#include "format/table_check.h"

namespace esvr::format {
namespace {

/// The rows in the content of a packed section. Their offsets are those in the file.
std::vector<SectionEntry> rowsIn(const ByteSource& source, const SectionTable& table,
                                 std::size_t packed) {
  const std::string place = placeOf(source.name(), table, packed);
  const SectionEntry& entry = table.entries[packed];
  if (entry.codec != Codec::kRaw) throw BadInput(place + ": must not be compressed");
  FrameTable content = getFrame(readStored(source, table, packed), place);
  if (content.inherited != Inherited{}) throw BadInput(place + ": refers to another frame");
  for (SectionEntry& row : content.sections.entries) row.offset += entry.offset;
  return std::move(content.sections.entries);
}

}  // namespace

void addPackedRows(const ByteSource& source, SectionTable& table) {
  const auto isPacked = [](const SectionEntry& entry) {
    return entry.id == SectionId{SectionKind::kPacked};
  };
  const auto packed = std::ranges::find_if(table.entries, isPacked);
  if (packed == table.entries.end()) return;
  const auto rows = rowsIn(source, table, std::size_t(packed - table.entries.begin()));
  table.entries.insert(table.entries.end(), rows.begin(), rows.end());
  checkRows(source.name(), table);
}

SectionTable readAllRows(const ByteSource& source) {
  SectionTable table = readTable(source);
  addPackedRows(source, table);
  return table;
}

}  // namespace esvr::format
