#include <algorithm>
#include <map>
#include <optional>

#include "esvr/container.h"
#include "format/byte_source.h"
#include "format/decode.h"
#include "format/frame_table.h"
#include "format/packed_sections.h"
#include "format/section_table.h"

namespace esvr {
namespace {

/// Takes the bytes of packed sections from those of the section that holds them.
void countPackedOnce(const format::SectionTable& table, EsvrSummary& summary) {
  using format::SectionKind;
  const auto holder = std::ranges::find(table.entries, format::SectionId{SectionKind::kPacked},
                                        &format::SectionEntry::id);
  if (holder == table.entries.end()) return;
  std::uint64_t& bytes = summary.sections[std::size_t(holder - table.entries.begin())].storedBytes;
  for (std::size_t i = 0; i < table.entries.size(); ++i) {
    const auto& e = table.entries[i];
    const bool isInside =
        e.offset > holder->offset && e.offset < holder->offset + holder->storedBytes;
    if (isInside && !summary.sections[i].sharedWith) bytes -= e.storedBytes;
  }
}

EsvrSummary summaryOf(const format::SectionTable& table) {
  EsvrSummary summary{table.versionMajor, table.versionMinor, table.fileBytes, {}};
  std::map<format::Placement, std::size_t> first;
  for (const auto& e : table.entries) {
    const auto [same, isFirst] = first.emplace(format::placementOf(e), summary.sections.size());
    summary.sections.push_back({format::nameOf(e.id.kind), format::nameOf(e.codec), e.id.grid,
                                e.storedBytes, e.rawBytes,
                                isFirst ? std::nullopt : std::optional(same->second)});
  }
  countPackedOnce(table, summary);
  return summary;
}

}  // namespace

EsvrFile readEsvr(const std::filesystem::path& path, const ReadLimits& limits) {
  return format::decode(format::FileSource(path), limits);
}

PartOfFile readEsvrPart(const std::filesystem::path& path, const ReadPart& part) {
  return format::decodePart(format::FileSource(path), part);
}

EsvrSummary inspectEsvr(const std::filesystem::path& path) {
  return summaryOf(format::readAllRows(format::FileSource(path)));
}

EsvrSummary inspectEsvr(std::span<const std::byte> bytes, const std::string& nameForErrors) {
  return summaryOf(format::isShortFrame(bytes)
                       ? format::getFrame(bytes, nameForErrors).sections
                       : format::readAllRows(format::MemorySource(bytes, nameForErrors)));
}

}  // namespace esvr
