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

/// The two files of a comparison.
struct ComparedFiles {
  const Options& options;
  VdbSummary written;

  /// True if a written grid has no active voxel, which readGrid and readVector would refuse.
  [[nodiscard]] bool isEmpty(const ComparedGrid& grid) const {
    return written.grids.at(grid.written).activeVoxels == 0;
  }
};

VolumeMetrics compare(const ComparedFiles& files, const ComparedGrid& grid) {
  const Options& options = files.options;
  const auto read = [&](const auto& path, std::size_t place) {
    return readGrid(path, place, readingOf(options)).volume;
  };
  const SparseVolume reference = read(*options.reference, grid.reference);
  const SparseVolume written =
      files.isEmpty(grid) ? SparseVolume{} : read(options.output, grid.written);
  return compareVolumes(reference, written, {.box = options.box, .ssim = true});
}

VectorMetrics compareVectorGrid(const ComparedFiles& files, const ComparedGrid& grid) {
  const Options& options = files.options;
  const auto read = [&](const auto& path, std::size_t place) {
    return readVector(path, place, readingOf(options)).components;
  };
  const VectorVolume reference = read(*options.reference, grid.reference);
  const VectorVolume written =
      files.isEmpty(grid) ? VectorVolume{} : read(options.output, grid.written);
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
void addRows(const ComparedFiles& files, const ComparedGrid& grid, cli::Table& table) {
  if (!grid.isVector) return table.add(row(grid.name, compare(files, grid)));
  const VectorMetrics metrics = compareVectorGrid(files, grid);
  table.add(row(grid.name, metrics.magnitude));
  for (std::size_t c = 0; c < kComponents; ++c)
    table.add(row(grid.components[c], metrics.components[c]));
}

}  // namespace

void printErrors(const Options& options, const std::vector<ComparedGrid>& grids,
                 std::ostream& out) {
  cli::Table table({"grid", "PSNR active", "PSNR box", "max error", "p99.9 error", "SSIM", "IoU",
                    "mass ref", "mass"});
  const ComparedFiles files{options, inspectVdb(options.output)};
  for (const auto& grid : grids) addRows(files, grid, table);
  table.print(out);
}

}  // namespace esvr::esvr2vdb
