#include "esvr/frame_coding.h"

#include <algorithm>

#include "format/decode.h"
#include "format/encode.h"
#include "format/section_reader.h"

namespace esvr {

std::vector<std::byte> encodeFrame(const EsvrFile& frame, const EsvrFile* previous) {
  return format::sectionsOf(frame, previous).assemble();
}

EsvrFile decodeFrame(std::span<const std::byte> bytes, const std::string& nameForErrors,
                     const ReadLimits& limits, const EsvrFile* previous) {
  return format::decode(format::MemorySource(bytes, nameForErrors), limits, previous);
}

bool dependsOnPrevious(std::span<const std::byte> bytes) {
  const format::MemorySource source(bytes, "frame");
  return format::SectionReader(source).count(format::SectionKind::kPredicted) > 0;
}

std::uint64_t bytesInFrame(const StoredGrid& grid, const StoredGrid* previous) {
  if (!previous) return bytesAdded(grid);
  const EsvrFile frame{{}, {grid}}, before{{}, {*previous}};
  return format::sectionsOf(frame, &before).bytesUnshared();
}

}  // namespace esvr
