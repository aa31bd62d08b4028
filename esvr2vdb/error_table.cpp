#include "esvr2vdb/error_table.h"

#include <ostream>

#include "cli/table.h"
#include "esvr/metrics.h"

namespace esvr::esvr2vdb {
namespace {

/// The written voxels; none if the grid has no active voxel, which readGrid would refuse.
SparseVolume readWritten(const Options& options, const std::string& name) {
  for (const auto& grid : inspectVdb(options.output).grids)
    if (grid.uniqueName == name && grid.activeVoxels == 0) return {};
  return readGrid(options.output, name,
                  {.maxBytes = options.memory.maxBytes, .memory = options.memory.voxels})
      .volume;
}

VolumeMetrics compare(const Options& options, const ComparedGrid& grid) {
  const SparseVolume reference =
      readGrid(*options.reference, grid.name,
               {.maxBytes = options.memory.maxBytes, .memory = options.memory.voxels})
          .volume;
  return compareVolumes(reference, readWritten(options, grid.writtenName),
                        {.box = options.box, .ssim = true});
}

std::vector<std::string> row(const std::string& name, const VolumeMetrics& m) {
  return {name,
          cli::decibels(m.psnrBox),
          cli::decibels(m.psnrActive),
          cli::shortNumber(m.maxError),
          cli::shortNumber(m.p999Error),
          cli::shortNumber(*m.ssim),
          cli::shortNumber(m.iou),
          cli::shortNumber(m.massReference),
          cli::shortNumber(m.massCandidate)};
}

}  // namespace

void printErrors(const Options& options, const std::vector<ComparedGrid>& grids,
                 std::ostream& out) {
  cli::Table table({"grid", "PSNR box", "active", "max error", "p99.9 error", "SSIM", "IoU",
                    "mass ref", "mass"});
  for (const auto& grid : grids) table.add(row(grid.name, compare(options, grid)));
  table.print(out);
}

}  // namespace esvr::esvr2vdb
