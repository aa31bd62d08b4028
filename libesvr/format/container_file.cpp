#include <map>
#include <optional>

#include "esvr/container.h"
#include "format/byte_source.h"
#include "format/decode.h"
#include "format/frame_table.h"
#include "format/section_table.h"

namespace esvr {
namespace {

EsvrSummary summaryOf(const format::SectionTable& table) {
  EsvrSummary summary{table.versionMajor, table.versionMinor, table.fileBytes, {}};
  std::map<format::Placement, std::size_t> first;
  for (const auto& e : table.entries) {
    const auto [same, isFirst] = first.emplace(format::placementOf(e), summary.sections.size());
    summary.sections.push_back({format::nameOf(e.id.kind), format::nameOf(e.codec), e.id.grid,
                                e.storedBytes, e.rawBytes,
                                isFirst ? std::nullopt : std::optional(same->second)});
  }
  return summary;
}

}  // namespace

EsvrFile readEsvr(const std::filesystem::path& path, const ReadLimits& limits) {
  return format::decode(format::FileSource(path), limits);
}

PartOfFile readEsvrPart(const std::filesystem::path& path, const ReadPart& part) {
  const format::FileSource source(path);
  PartOfFile result;
  result.file = format::decodePart(source, part);
  result.bytesRead = source.bytesRead();
  return result;
}

EsvrSummary inspectEsvr(const std::filesystem::path& path) {
  return summaryOf(format::readTable(format::FileSource(path)));
}

EsvrSummary inspectEsvr(std::span<const std::byte> bytes, const std::string& nameForErrors) {
  return summaryOf(format::isShortFrame(bytes)
                       ? format::getFrame(bytes, nameForErrors).sections
                       : format::readTable(format::MemorySource(bytes, nameForErrors)));
}

}  // namespace esvr
