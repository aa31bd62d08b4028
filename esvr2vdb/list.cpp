#include <algorithm>
#include <iostream>

#include "cli/listing.h"
#include "cli/names.h"
#include "cli/printable.h"
#include "cli/table.h"
#include "esvr/container.h"
#include "esvr2vdb/choose_grids.h"
#include "esvr2vdb/jobs.h"

namespace esvr::esvr2vdb {
namespace {

std::string textOf(const Kernel& kernel) {
  return cli::nameOf(kernel.form) + " " + cli::shortNumber(kernel.kappa);
}

std::string bytesPerEllipsoid(std::uint64_t bytes, std::size_t ellipsoids) {
  return ellipsoids == 0 ? "-" : cli::shortNumber(double(bytes) / double(ellipsoids));
}

struct Listing {
  EsvrFile file;
  EsvrSummary summary;
  std::vector<std::string> names;
};

const char* purposeOf(const Field& field) {
  if (field.ellipsoidCount() == 0) return "-";
  return field.fitFor == FitFor::kDrawing ? "drawing" : "voxels";
}

void printGrids(const Listing& listing) {
  cli::Table table({"grid", "class", "values", "active voxels", "ellipsoids", "fitted for",
                    "kernel, kappa", "active by", "bytes", "bytes each"});
  for (std::size_t g = 0; g < listing.file.grids.size(); ++g) {
    const StoredGrid& grid = listing.file.grids[g];
    const std::uint64_t bytes = cli::storedBytes(listing.summary, g);
    const std::uint64_t own = cli::ownBytes(listing.summary, g);
    const std::size_t ellipsoids = grid.field.ellipsoidCount();
    table.add({listing.names[g], cli::nameOf(grid.descriptor.gridClass),
               cli::nameOf(grid.descriptor.valueType), std::to_string(grid.activeVoxels),
               std::to_string(ellipsoids), purposeOf(grid.field), textOf(grid.field.kernel),
               cli::nameOf(grid.topology), std::to_string(own),
               bytesPerEllipsoid(bytes, ellipsoids)});
  }
  table.print(std::cout);
}

/// The name of a section's grid; "-" if it belongs to the file.
std::string gridOf(const Listing& listing, const SectionSummary& section) {
  return section.grid < listing.names.size() ? listing.names[section.grid] : "-";
}

void printSections(const Listing& listing) {
  cli::Table table({"section", "of grid", "codec", "bytes", "raw bytes", "shared with"});
  const auto& sections = listing.summary.sections;
  for (const auto& s : sections)
    table.add({s.kind, gridOf(listing, s), s.codec, std::to_string(s.storedBytes),
               std::to_string(s.rawBytes),
               s.sharedWith ? gridOf(listing, sections[*s.sharedWith]) : "-"});
  table.print(std::cout);
}

void addStream(cli::Table& table, const std::string& grid, const char* stream, std::uint64_t bytes,
               std::size_t ellipsoids) {
  table.add({grid, stream, std::to_string(bytes), bytesPerEllipsoid(bytes, ellipsoids)});
}

/// Prints the bytes of the quantised ellipsoids, by stream.
void printStreams(const Listing& listing) {
  cli::Table table({"grid", "stream", "bytes", "bytes each"});
  for (std::size_t g = 0; g < listing.file.grids.size(); ++g) {
    const StoredGrid& grid = listing.file.grids[g];
    if (grid.quantised.empty()) continue;
    const StreamBytes bytes = streamBytes(grid);
    const std::size_t ellipsoids = grid.field.ellipsoidCount();
    addStream(table, listing.names[g], "positions", bytes.positions, ellipsoids);
    addStream(table, listing.names[g], "scales", bytes.scales, ellipsoids);
    addStream(table, listing.names[g], "rotations", bytes.rotations, ellipsoids);
    addStream(table, listing.names[g], "intensities", bytes.intensities, ellipsoids);
  }
  table.print(std::cout);
}

/// Prints the error and the bytes of the first layers.
void printLayers(const Listing& listing) {
  cli::Table table({"grid", "layers", "ellipsoids", "bytes", "PSNR box", "max error"});
  for (std::size_t g = 0; g < listing.file.grids.size(); ++g) {
    const auto& errors = listing.file.grids[g].layerErrors;
    const auto sizes = layerSizes(listing.file.grids[g]);
    LayerSize sum;
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      sum.ellipsoids += sizes[k].ellipsoids;
      sum.bytes += sizes[k].bytes;
      const bool known = k < errors.size();
      table.add({listing.names[g], std::to_string(k + 1), std::to_string(sum.ellipsoids),
                 std::to_string(sum.bytes), known ? cli::decibels(errors[k].psnrBox) : "-",
                 known ? cli::shortNumber(errors[k].maxError) : "-"});
    }
  }
  table.print(std::cout);
}

void printDetails(const Listing& listing) {
  cli::printMetadata("file metadata", listing.file.metadata, std::cout);
  for (std::size_t g = 0; g < listing.file.grids.size(); ++g) {
    const StoredGrid& grid = listing.file.grids[g];
    const std::string name = cli::printable(listing.names[g]);
    std::cout << name << ": " << cli::printable(grid.descriptor.transform.mapType)
              << ", background " << cli::shortNumber(grid.descriptor.background) << ", values "
              << cli::shortNumber(grid.valueMin) << " to " << cli::shortNumber(grid.valueMax)
              << ", threshold " << cli::shortNumber(grid.activeThreshold) << ", active box "
              << cli::textOf(grid.activeBox) << ", chunks " << grid.field.chunks.size() << '\n';
    cli::printMetadata(listing.names[g] + " metadata", grid.descriptor.metadata, std::cout);
  }
}

}  // namespace

void list(const Options& options) {
  const auto extension = options.input.extension();
  if (extension == ".vdb" || extension == ".nvdb") return listVdb(options);
  Listing listing{readEsvr(options.input, {options.memory.maxBytes, options.memory.voxels}),
                  inspectEsvr(options.input),
                  {}};
  listing.names = uniqueNames(listing.file);
  std::cout << cli::printable(options.input.string()) << ": .esvr format "
            << listing.summary.versionMajor << '.' << listing.summary.versionMinor << ", "
            << listing.summary.fileBytes << " bytes\n\n";
  printGrids(listing);
  std::cout << '\n';
  printSections(listing);
  if (options.verbosity != cli::Verbosity::kVerbose) return;
  std::cout << '\n';
  printStreams(listing);
  std::cout << '\n';
  printLayers(listing);
  std::cout << '\n';
  printDetails(listing);
}

}  // namespace esvr::esvr2vdb
