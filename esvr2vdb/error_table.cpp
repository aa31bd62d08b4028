#include "esvr2vdb/error_table.h"

#include <ostream>

#include "cli/table.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "esvr/vector_metrics.h"

namespace esvr::esvr2vdb {
namespace {

ReadOptions readingOf(const Options& options) {
  return {.maxBytes = options.memory.maxBytes, .memory = options.memory.voxels};
}

/// True if a written grid has no active voxel, which readGrid and readVector would refuse.
bool isEmpty(const Options& options, const std::string& name) {
  for (const auto& grid : inspectVdb(options.output).grids)
    if (grid.uniqueName == name && grid.activeVoxels == 0) return true;
  return false;
}

VolumeMetrics compare(const Options& options, const ComparedGrid& grid) {
  const auto read = [&](const auto& path, const std::string& name) {
    return readGrid(path, name, readingOf(options)).volume;
  };
  const SparseVolume reference = read(*options.reference, grid.name);
  const SparseVolume written =
      isEmpty(options, grid.writtenName) ? SparseVolume{} : read(options.output, grid.writtenName);
  return compareVolumes(reference, written, {.box = options.box, .ssim = true});
}

VectorMetrics compareVectorGrid(const Options& options, const ComparedGrid& grid) {
  const auto read = [&](const auto& path, const std::string& name) {
    return readVector(path, name, readingOf(options)).components;
  };
  const VectorVolume reference = read(*options.reference, grid.name);
  const VectorVolume written =
      isEmpty(options, grid.writtenName) ? VectorVolume{} : read(options.output, grid.writtenName);
  return compareVectors(reference, written, {.box = options.box, .ssim = true});
}

std::vector<std::string> row(const std::string& name, const VolumeMetrics& m) {
  return {name,
          cli::decibels(m.psnrActive),
          cli::decibels(m.psnrBox),
          cli::shortNumber(m.maxError),
          cli::shortNumber(m.p999Error),
          cli::shortNumber(*m.ssim),
          cli::shortNumber(m.iou),
          cli::shortNumber(m.massReference),
          cli::shortNumber(m.massCandidate)};
}

/// Adds a row, or for vectors one for their lengths and one for each component.
void addRows(const Options& options, const ComparedGrid& grid, cli::Table& table) {
  if (!grid.isVector) return table.add(row(grid.name, compare(options, grid)));
  const VectorMetrics metrics = compareVectorGrid(options, grid);
  table.add(row(grid.name, metrics.magnitude));
  for (std::size_t c = 0; c < kComponents; ++c)
    table.add(row(componentName(grid.name, c), metrics.components[c]));
}

}  // namespace

void printErrors(const Options& options, const std::vector<ComparedGrid>& grids,
                 std::ostream& out) {
  cli::Table table({"grid", "PSNR active", "PSNR box", "max error", "p99.9 error", "SSIM", "IoU",
                    "mass ref", "mass"});
  for (const auto& grid : grids) addRows(options, grid, table);
  table.print(out);
}

}  // namespace esvr::esvr2vdb
