#include "esvr/frame_coding.h"

#include "esvr/error.h"
#include "format/decode.h"
#include "format/encode.h"
#include "format/frame_table.h"

namespace esvr {

std::vector<std::byte> encodeFrame(const EsvrFile& frame, const EsvrFile* previous) {
  if (previous)
    if (auto differences = format::differencesOf(frame, *previous))
      return differences->sections.assembleFrame(differences->inherited);
  // A sequence has many small frames, so that each saves rows of its table where it can.
  return format::sectionsOf(frame, FileLayout::kCompact).assemble();
}

EsvrFile decodeFrame(std::span<const std::byte> bytes, const std::string& nameForErrors,
                     const ReadLimits& limits, const EsvrFile* previous) {
  if (!format::isShortFrame(bytes)) return decodeEsvr(bytes, nameForErrors, limits);
  if (!previous) throw BadInput(nameForErrors + ": it cannot be read without the frame before");
  return format::decodeShort(bytes, nameForErrors, limits, *previous);
}

bool dependsOnPrevious(std::span<const std::byte> bytes) {
  if (format::isShortFrame(bytes)) return true;
  (void)format::readTable(format::MemorySource(bytes, "frame"));
  return false;
}

std::uint64_t bytesInFrame(const StoredGrid& grid, const StoredGrid* previous) {
  const std::uint64_t own = bytesAdded(grid);
  if (previous)
    if (const auto difference = format::differenceOf(grid, *previous, own))
      return difference->size() + format::kFrameRowBytes;
  return own;
}

}  // namespace esvr
