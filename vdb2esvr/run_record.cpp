#include "vdb2esvr/run_record.h"

#include <algorithm>
#include <set>

#include "cli/names.h"
#include "esvr/error.h"

namespace esvr::vdb2esvr {

bool hasSection(const EsvrSummary& file, std::size_t grid, const std::string& kind) {
  return std::any_of(file.sections.begin(), file.sections.end(),
                     [&](const SectionSummary& s) { return s.grid == grid && s.kind == kind; });
}

std::uint64_t bytesOf(const EsvrSummary& file, std::size_t grid, const std::string& kind) {
  std::uint64_t bytes = 0;
  for (const SectionSummary& s : file.sections)
    if (s.grid == grid && s.kind == kind) bytes += s.storedBytes;
  return bytes;
}

std::size_t numberOfCarried(const RunRecord& record, std::size_t carried) {
  return record.grids.size() + carried;
}

std::uint64_t ownBytes(const EsvrSummary& file, const ConvertedVector& vector) {
  std::uint64_t bytes = 0;
  for (std::size_t c = 0; c < kComponents; ++c)
    bytes += cli::ownBytes(file, vector.stored.first + c);
  return bytes;
}

Ratio ratioOf(const RunRecord& record) {
  const std::size_t converted = record.grids.size() - record.vectors.size() * (kComponents - 1);
  Ratio ratio{0, record.output.fileBytes, converted + record.carried.size(),
              record.input.grids.size()};
  if (ratio.wholeInput()) {
    ratio.bytesIn = record.input.fileBytes;
    return ratio;
  }
  std::set<std::size_t> places;  // components share the place of their grid
  for (const ConvertedGrid& grid : record.grids) places.insert(grid.id.place);
  for (const std::size_t place : places) ratio.bytesIn += record.input.grids[place].storedBytes;
  for (const NotFitted& carried : record.carried) ratio.bytesIn += carried.grid.storedBytes;
  return ratio;
}

const ConvertedGrid* firstBelow(const RunRecord& record) {
  const auto below = std::ranges::find_if(record.grids, [](const ConvertedGrid& grid) {
    return grid.wantedPsnr && !(grid.metrics.psnrBox >= *grid.wantedPsnr);
  });
  return below == record.grids.end() ? nullptr : &*below;
}

int exitCodeOf(const RunRecord& record) {
  if (record.interrupted) return int(ErrorKind::kRuntime);
  return firstBelow(record) ? int(ErrorKind::kTargetMissed) : 0;
}

}  // namespace esvr::vdb2esvr
