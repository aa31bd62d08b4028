#include <algorithm>
#include <iostream>
#include <map>

#include "cli/listing.h"
#include "cli/names.h"
#include "cli/printable.h"
#include "cli/table.h"
#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "esvr/sequence_file.h"
#include "esvr/vdb_io.h"
#include "esvr2vdb/choose_grids.h"
#include "esvr2vdb/jobs.h"

namespace esvr::esvr2vdb {
namespace {

std::string textOf(const Kernel& kernel) {
  return cli::nameOf(kernel.form) + " " + cli::shortNumber(kernel.kappa);
}

std::string bytesPerEllipsoid(std::uint64_t bytes, std::uint64_t ellipsoids) {
  return ellipsoids == 0 ? "-" : cli::shortNumber(double(bytes) / double(ellipsoids));
}

struct Listing {
  const Options& options;
  EsvrFile file;
  std::vector<std::uint64_t> ellipsoids;  ///< number of ellipsoids of each of the file's grids
  EsvrSummary summary;
  std::vector<ListedGrid> grids;    ///< in file order
  std::vector<ListedGrid> parts{};  ///< the same, with the components in place of vectors
  std::map<std::size_t, std::string> names{};  ///< of the parts, by their numbers in the summary

  /// The number of a grid in the summary.
  [[nodiscard]] std::size_t numberOf(const GridOfFile& grid) const {
    return grid.index + (grid.isCarried ? file.grids.size() : 0);
  }
};

/// The grids and the components of vectors.
std::vector<ListedGrid> withComponents(const EsvrFile& file, const std::vector<ListedGrid>& grids) {
  const GridNames names(namesInOrder(file));
  std::vector<ListedGrid> parts;
  for (const ListedGrid& named : grids) {
    if (!named.grid.isVector) {
      parts.push_back(named);
      continue;
    }
    for (std::size_t c = 0; c < kComponents; ++c)
      parts.push_back({{false, file.vectors[named.grid.index].first + c},
                       names.ofComponent(named.place, c),
                       named.place});
  }
  return parts;
}

/// OpenVDB's name of the type of vectors whose components have this type.
std::string vectorsOf(ValueType component) {
  if (component == ValueType::kDouble) return "vec3d";
  return component == ValueType::kHalf ? "vec3s as half" : "vec3s";
}

/// The row of a grid of vectors. The rows of its components follow.
std::vector<std::string> rowOfVector(const Listing& listing, const ListedGrid& named) {
  const StoredVector& vector = listing.file.vectors[named.grid.index];
  std::uint64_t voxels = 0, bytes = 0, ellipsoids = 0;
  for (std::size_t g = vector.first; g < vector.first + kComponents; ++g) {
    voxels = std::max(voxels, listing.file.grids[g].activeVoxels);
    ellipsoids += listing.ellipsoids[g];
    bytes += cli::ownBytes(listing.summary, g);
  }
  const GridDescriptor& descriptor = listing.file.grids[vector.first].descriptor;
  return {named.name,
          className(descriptor.gridClass),
          vectorsOf(descriptor.valueType),
          std::to_string(voxels),
          std::to_string(ellipsoids),
          "-",
          "-",
          "-",
          std::to_string(bytes),
          "-"};
}

std::vector<std::string> rowOfStored(const Listing& listing, const ListedGrid& named) {
  const StoredGrid& grid = listing.file.grids[named.grid.index];
  const std::uint64_t bytes = cli::storedBytes(listing.summary, named.grid.index);
  const std::uint64_t ellipsoids = listing.ellipsoids[named.grid.index];
  return {named.name,
          className(grid.descriptor.gridClass),
          cli::nameOf(grid.descriptor.valueType),
          std::to_string(grid.activeVoxels),
          std::to_string(ellipsoids),
          textOf(grid.field.kernel),
          cli::nameOf(grid.topology),
          std::to_string(cli::ownBytes(listing.summary, named.grid.index)),
          bytesPerEllipsoid(bytes, ellipsoids)};
}

/// \throws BadInput  the bytes are not those of a grid
GridSummary summaryOf(const Options& options, const CarriedGrid& grid) try {
  return inspectCarried(grid);
} catch (const BadInput& error) {
  throw BadInput(options.input.string() + ": " + error.what());
}

std::vector<std::string> rowOfCarried(const Listing& listing, const ListedGrid& named) {
  const GridSummary grid = summaryOf(listing.options, listing.file.carried[named.grid.index]);
  const std::size_t number = listing.numberOf(named.grid);
  return {named.name,
          className(grid.gridClass),
          cli::valuesOf(grid),
          cli::activeVoxelsOf(grid),
          "carried",
          "-",
          "-",
          "-",
          std::to_string(cli::ownBytes(listing.summary, number)),
          "-"};
}

void printGrids(const Listing& listing) {
  cli::Table table({"grid", "class", "values", "active voxels", "ellipsoids", "kernel, kappa",
                    "active by", "bytes", "bytes each"});
  std::size_t place = listing.grids.size();
  for (const ListedGrid& part : listing.parts) {
    const ListedGrid& grid = listing.grids[part.place];
    if (grid.grid.isVector && part.place != place) table.add(rowOfVector(listing, grid));
    place = part.place;
    table.add(part.grid.isCarried ? rowOfCarried(listing, part) : rowOfStored(listing, part));
  }
  table.print(std::cout);
}

/// The name of a section's grid; "-" if it belongs to the file.
std::string gridOf(const Listing& listing, const SectionSummary& section) {
  const auto name = listing.names.find(section.grid);
  return name == listing.names.end() ? "-" : name->second;
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
  for (const auto& [place, name, number] : listing.parts) {
    if (place.isCarried) continue;
    const StoredGrid& grid = listing.file.grids[place.index];
    if (grid.quantised.empty()) continue;
    const StreamBytes bytes = streamBytes(grid);
    const std::size_t ellipsoids = grid.field.ellipsoidCount();
    addStream(table, name, "positions", bytes.positions, ellipsoids);
    addStream(table, name, "scales", bytes.scales, ellipsoids);
    addStream(table, name, "rotations", bytes.rotations, ellipsoids);
    addStream(table, name, "intensities", bytes.intensities, ellipsoids);
  }
  table.print(std::cout);
}

/// Prints the error and the bytes of the first layers.
void printLayers(const Listing& listing) {
  cli::Table table({"grid", "layers", "ellipsoids", "bytes", "PSNR box", "max error"});
  for (const auto& [place, name, number] : listing.parts) {
    if (place.isCarried) continue;
    const auto& errors = listing.file.grids[place.index].layerErrors;
    const auto sizes = layerSizes(listing.file.grids[place.index]);
    LayerSize sum;
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      sum.ellipsoids += sizes[k].ellipsoids;
      sum.bytes += sizes[k].bytes;
      const bool known = k < errors.size();
      table.add({name, std::to_string(k + 1), std::to_string(sum.ellipsoids),
                 std::to_string(sum.bytes), known ? cli::decibels(errors[k].psnrBox) : "-",
                 known ? cli::shortNumber(errors[k].maxError) : "-"});
    }
  }
  table.print(std::cout);
}

/// The name of the grid whose voxels those of a grid refer to; empty if there is none.
std::string referenceOf(const Listing& listing, const StoredGrid& grid) {
  if (!grid.reference || !grid.reference->grid) return "";
  const auto name = listing.names.find(*grid.reference->grid);
  return name == listing.names.end() ? "" : name->second;
}

void printStoredDetails(const Listing& listing, const std::string& name, const StoredGrid& grid) {
  std::cout << cli::printable(name) << ": " << cli::printable(grid.descriptor.transform.mapType)
            << ", background " << cli::shortNumber(grid.descriptor.background) << ", values "
            << cli::shortNumber(grid.valueMin) << " to " << cli::shortNumber(grid.valueMax) << ", "
            << cli::activityOf(grid) << ", active box " << cli::textOf(grid.activeBox)
            << ", chunks " << grid.field.chunks.size();
  if (const std::string reference = referenceOf(listing, grid); !reference.empty())
    std::cout << ", voxels refer to " << cli::printable(reference);
  std::cout << '\n';
  cli::printMetadata(name + " metadata", grid.descriptor.metadata, std::cout);
}

void printCarriedDetails(const Options& options, const std::string& name, const CarriedGrid& grid) {
  std::cout << cli::printable(name) << ": carried unchanged, " << cli::printable(grid.treeType)
            << ", " << grid.bytes.size() << " bytes of VDB format " << grid.vdbVersion
            << ", active box " << cli::textOf(summaryOf(options, grid).activeBox) << '\n';
}

void printDetails(const Listing& listing) {
  cli::printMetadata("file metadata", listing.file.metadata, std::cout);
  for (const auto& [grid, name, number] : listing.parts)
    if (grid.isCarried)
      printCarriedDetails(listing.options, name, listing.file.carried[grid.index]);
    else
      printStoredDetails(listing, name, listing.file.grids[grid.index]);
}

/// Reads a file. A table of its grids needs their records only; details need all of it.
PartOfFile readForList(const Options& options) {
  ReadPart wanted{.carriedBytes = true, .limits = limitsOf(options)};
  if (options.verbosity != cli::Verbosity::kVerbose) wanted.grids.emplace();
  return readEsvrPart(options.input, wanted);
}

}  // namespace

void list(const Options& options) {
  if (const auto pattern = cli::FramePattern::ofInput(options.input.string()))
    return listFrames(options, *pattern);
  const auto extension = options.input.extension();
  if (extension == ".vdb" || extension == ".nvdb") return listVdb(options);
  if (holdsSequence(options.input)) return listSequence(options);
  PartOfFile part = readForList(options);
  Listing listing{options,
                  std::move(part.file),
                  std::move(part.ellipsoidsInFile),
                  inspectEsvr(options.input),
                  {}};
  listing.grids = listedGrids(listing.file);
  listing.parts = withComponents(listing.file, listing.grids);
  for (const ListedGrid& listed : listing.parts)
    listing.names[listing.numberOf(listed.grid)] = listed.name;
  std::cout << cli::printable(options.input.string()) << ": .esvr format "
            << listing.summary.versionMajor << '.' << listing.summary.versionMinor << ", "
            << listing.summary.fileBytes << " bytes" << (listing.grids.empty() ? ", no grid" : "")
            << "\n\n";
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
