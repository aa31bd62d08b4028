#include <iostream>

#include "cli/listing.h"
#include "cli/names.h"
#include "cli/printable.h"
#include "cli/table.h"
#include "esvr/grid_names.h"
#include "esvr/vdb_io.h"
#include "esvr2vdb/jobs.h"

namespace esvr::esvr2vdb {
namespace {

void printGrids(const VdbSummary& file) {
  cli::Table table({"grid", "class", "values", "active voxels", "bytes"});
  for (const auto& grid : file.grids)
    table.add({grid.uniqueName, className(grid.gridClass), cli::valuesOf(grid),
               cli::activeVoxelsOf(grid), std::to_string(grid.storedBytes)});
  table.print(std::cout);
}

void printDetails(const VdbSummary& file) {
  cli::printMetadata("file metadata", file.metadata, std::cout);
  for (const auto& grid : file.grids) {
    std::cout << cli::printable(grid.uniqueName) << ": active box " << cli::textOf(grid.activeBox);
    if (!grid.skipReason.empty()) std::cout << "; " << cli::printable(grid.skipReason);
    std::cout << '\n';
  }
}

}  // namespace

void listVdb(const Options& options) {
  const VdbSummary file = inspectVdb(options.input);
  std::cout << cli::printable(options.input.string()) << ": " << file.format << ", "
            << file.fileBytes << " bytes" << (file.grids.empty() ? ", no grid" : "") << "\n\n";
  printGrids(file);
  if (options.verbosity != cli::Verbosity::kVerbose) return;
  std::cout << '\n';
  printDetails(file);
}

}  // namespace esvr::esvr2vdb
