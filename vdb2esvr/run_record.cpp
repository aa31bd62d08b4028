#include "vdb2esvr/run_record.h"

#include <algorithm>

#include "esvr/error.h"

namespace esvr::vdb2esvr {

bool hasSection(const EsvrSummary& file, std::size_t grid, const std::string& kind) {
  return std::any_of(file.sections.begin(), file.sections.end(),
                     [&](const SectionSummary& s) { return s.grid == grid && s.kind == kind; });
}

std::size_t numberOfCarried(const RunRecord& record, std::size_t carried) {
  return record.grids.size() + carried;
}

Ratio ratioOf(const RunRecord& record) {
  Ratio ratio{0, record.output.fileBytes, record.grids.size() + record.carried.size(),
              record.input.grids.size()};
  if (ratio.wholeInput()) {
    ratio.bytesIn = record.input.fileBytes;
    return ratio;
  }
  const auto converted = [&](const GridSummary& summary) {
    return std::any_of(record.grids.begin(), record.grids.end(),
                       [&](const auto& grid) { return grid.uniqueName == summary.uniqueName; });
  };
  for (const GridSummary& grid : record.input.grids)
    if (converted(grid)) ratio.bytesIn += grid.storedBytes;
  for (const NotFitted& carried : record.carried) ratio.bytesIn += carried.grid.storedBytes;
  return ratio;
}

const ConvertedGrid* firstBelow(const RunRecord& record, std::optional<double> psnr) {
  if (!psnr) return nullptr;
  const auto below = std::find_if(record.grids.begin(), record.grids.end(), [&](const auto& grid) {
    return !(grid.metrics.psnrBox >= *psnr);
  });
  return below == record.grids.end() ? nullptr : &*below;
}

int exitCodeOf(const RunRecord& record, std::optional<double> psnr) {
  if (record.interrupted) return int(ErrorKind::kRuntime);
  return firstBelow(record, psnr) ? int(ErrorKind::kTargetMissed) : 0;
}

}  // namespace esvr::vdb2esvr
