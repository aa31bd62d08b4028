#include <algorithm>
#include <filesystem>
#include <iostream>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "cli/interrupts.h"
#include "cli/output.h"
#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "esvr/level_of_detail.h"
#include "esvr2vdb/choose_grids.h"
#include "esvr2vdb/error_table.h"
#include "esvr2vdb/jobs.h"

namespace esvr::esvr2vdb {
namespace {

/// A grid that was decoded.
using DecodedGrid = std::variant<VolumeGrid, VectorGrid>;

/// Checks everything that can be checked before the work begins.
void checkFiles(const Options& options) {
  std::vector<std::filesystem::path> files{options.input, options.output};
  if (options.reference) files.push_back(*options.reference);
  cli::requireDistinct(files);
  cli::checkOutput(options.output, {".vdb", ".nvdb"}, options.write.overwrite);
}

bool writesNano(const Options& options) { return options.output.extension() == ".nvdb"; }

/// Why the output cannot hold carried grids; null if it can.
const char* whyNoCarried(const Options& options) {
  if (!readsAll(options)) return "--lod, --max-ellipsoids and --bbox cannot cut a carried grid";
  if (writesNano(options)) return "a NanoVDB file cannot hold a carried grid";
  return nullptr;
}

/// Why the output cannot hold a grid; null if it can.
const char* whyNot(const GridOfFile& grid, const Options& options) {
  if (grid.isCarried) return whyNoCarried(options);
  if (grid.isVector && writesNano(options)) return "vectors are not written to NanoVDB files";
  return nullptr;
}

/// Restricts what is read to the named grids. Only the records of the file are read for this.
void restrictToNamed(const Options& options, ReadPart& wanted) {
  wanted.grids.emplace();
  const EsvrFile file = readEsvrPart(options.input, wanted).file;
  for (const auto& [grid, name] : chooseGrids(options.input, file, options.grids)) {
    if (grid.isCarried) {
      wanted.carriedBytes = true;
      continue;
    }
    const std::size_t first = grid.isVector ? file.vectors[grid.index].first : grid.index;
    for (std::size_t c = 0; c < (grid.isVector ? kComponents : 1); ++c)
      wanted.grids->push_back(first + c);
  }
}

EsvrFile read(const Options& options, const cli::Log& log) {
  ReadPart wanted = options.part;
  wanted.limits = limitsOf(options);
  if (!options.grids.empty()) restrictToNamed(options, wanted);
  if (readsAll(options) && !wanted.grids) return readEsvr(options.input, wanted.limits);
  PartOfFile part = readEsvrPart(options.input, wanted);
  // Small files are read once for the names of the grids, and once more for the grids.
  const std::uint64_t bytes = std::filesystem::file_size(options.input);
  if (part.bytesRead < bytes)
    log.info("read " + std::to_string(part.bytesRead) + " of " + std::to_string(bytes) + " bytes");
  return std::move(part.file);
}

/// The chosen grids that the output can hold. Says which of them are left out.
/// \throws UsageError  a grid that it cannot hold is named
/// \throws BadInput  no grid is left
std::vector<NamedGrid> writable(const std::vector<NamedGrid>& chosen, const Options& options,
                                const cli::Log& log) {
  std::vector<NamedGrid> kept;
  for (const NamedGrid& grid : chosen) {
    const char* why = whyNot(grid.grid, options);
    if (!why) {
      kept.push_back(grid);
      continue;
    }
    const std::string text = "grid \"" + grid.name + "\" ";
    if (!options.grids.empty())
      throw UsageError(options.output.string() + ": " + text + "cannot be written: " + why);
    log.warning(text + "is left out: " + why);
  }
  if (kept.empty() && !chosen.empty())
    throw BadInput(options.input.string() + ": no grid is left to write");
  return kept;
}

/// True if a part of a grid's ellipsoids is wanted, which a frame of a sequence still has in full.
bool isCut(const Options& options) { return options.maxEllipsoids || options.part.layers; }

StoredGrid wantedPart(const StoredGrid& grid, const Options& options) {
  const StoredGrid part = options.part.layers ? firstLayers(grid, *options.part.layers) : grid;
  return options.maxEllipsoids ? heaviest(part, *options.maxEllipsoids) : part;
}

VolumeGrid decoded(const StoredGrid& grid, const Options& options, const DecodeOptions& decode) {
  VolumeGrid result;
  result.descriptor = grid.descriptor;
  result.volume =
      isCut(options) ? decodeGrid(wantedPart(grid, options), decode) : decodeGrid(grid, decode);
  return result;
}

VectorGrid decoded(const EsvrFile& file, const StoredVector& vector, const Options& options,
                   const DecodeOptions& decode) {
  const StoredComponents components = componentsOf(file, vector);
  if (!isCut(options)) return decodeVector(vector.name, components, decode);
  std::vector<StoredGrid> parts;
  for (const StoredGrid& component : components) parts.push_back(wantedPart(component, options));
  return decodeVector(vector.name, std::span(parts).first<kComponents>(), decode);
}

/// Bytes of a volume in memory.
std::uint64_t bytesOf(const SparseVolume& volume) {
  const std::uint64_t values = volume.values.size() * sizeof(float);
  return volume.brickCount() * (sizeof(BrickMask) + sizeof(Coord)) +
         (memoryOf(volume).isInFile(values) ? 0 : values);
}

std::uint64_t bytesOf(const DecodedGrid& grid) {
  if (const auto* number = std::get_if<VolumeGrid>(&grid)) return bytesOf(number->volume);
  std::uint64_t bytes = 0;
  for (const auto& component : std::get<VectorGrid>(grid).components) bytes += bytesOf(component);
  return bytes;
}

std::uint64_t activeVoxelsOf(const DecodedGrid& grid) {
  if (const auto* number = std::get_if<VolumeGrid>(&grid)) return activeVoxelCount(number->volume);
  std::uint64_t voxels = 0;
  for (const auto& component : std::get<VectorGrid>(grid).components)
    voxels += activeVoxelCount(component);
  return voxels;
}

const GridDescriptor& descriptorOf(const DecodedGrid& grid) {
  return std::visit([](const auto& g) -> const GridDescriptor& { return g.descriptor; }, grid);
}

void tellEmpty(const DecodedGrid& grid, const cli::Log& log) {
  if (activeVoxelsOf(grid) == 0)
    log.warning("grid \"" + descriptorOf(grid).name + "\" comes back without an active voxel");
}

DecodedGrid decoded(const EsvrFile& file, const GridOfFile& grid, const Options& options,
                    const DecodeOptions& decode) {
  if (grid.isVector) return decoded(file, file.vectors[grid.index], options, decode);
  return decoded(file.grids[grid.index], options, decode);
}

/// The grids that are not carried, in order.
std::vector<DecodedGrid> decodeAll(const EsvrFile& file, const std::vector<NamedGrid>& chosen,
                                   const Options& options, const cli::Log& log) {
  std::vector<DecodedGrid> grids;
  DecodeOptions decode = options.decode;
  decode.maxBytes = options.memory.maxBytes;
  decode.memory = options.memory.voxels;
  for (const NamedGrid& named : chosen) {
    if (named.grid.isCarried) continue;
    grids.push_back(decoded(file, named.grid, options, decode));
    tellEmpty(grids.back(), log);
    // All grids are in memory, and twice while they are written.
    decode.maxBytes -= std::min(decode.maxBytes, 2 * bytesOf(grids.back()));
  }
  return grids;
}

/// All chosen grids in order. \param decoded  those that are not carried
std::vector<GridToWrite> inOrder(const EsvrFile& file, const std::vector<NamedGrid>& chosen,
                                 const std::vector<DecodedGrid>& decoded) {
  std::vector<GridToWrite> all;
  auto next = decoded.begin();
  for (const auto& [grid, name] : chosen)
    if (grid.isCarried)
      all.emplace_back(&file.carried[grid.index]);
    else
      all.push_back(std::visit([](const auto& g) { return GridToWrite(&g); }, *next++));
  return all;
}

/// Warns that a NanoVDB file cannot hold metadata.
void tellLostMetadata(const EsvrFile& file, const std::vector<DecodedGrid>& grids,
                      const Options& options, const cli::Log& log) {
  if (!writesNano(options)) return;
  std::size_t items = file.metadata.size();
  for (const auto& grid : grids) items += descriptorOf(grid).metadata.size();
  if (items == 0) return;
  log.warning("a NanoVDB file holds no metadata, which is left out",
              std::to_string(items) + " items");
}

/// The names of the chosen grids in the output.
std::vector<std::string> writtenNames(const EsvrFile& file, const std::vector<NamedGrid>& chosen) {
  std::vector<std::string> names;
  for (const auto& [grid, name] : chosen) names.push_back(nameOf(file, grid));
  return uniqueNames(names);
}

/// Finds each grid that is not carried in the reference, before anything is written.
std::vector<ComparedGrid> counterparts(const EsvrFile& file, const std::vector<NamedGrid>& chosen,
                                       const Options& options) {
  const auto written = writtenNames(file, chosen);
  std::vector<std::string> referenceNames;
  for (const auto& grid : inspectVdb(*options.reference).grids) referenceNames.push_back(grid.name);
  std::vector<ComparedGrid> grids;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (chosen[i].grid.isCarried) continue;
    (void)findGrid(referenceNames, chosen[i].name, *options.reference);
    grids.push_back({chosen[i].name, written[i], chosen[i].grid.isVector});
  }
  return grids;
}

}  // namespace

ReadLimits limitsOf(const Options& options) {
  return {options.memory.maxBytes, options.memory.voxels, whyNoCarried(options) == nullptr};
}

void convert(const Options& options) {
  const cli::Interrupts interrupts;
  checkFiles(options);
  convertFile(options, interrupts.token(), cli::Log(kProgram, options.verbosity), std::cout);
}

void convertFile(const Options& options, const CancelToken& cancel, const cli::Log& log,
                 std::ostream& out) {
  convertContent(options, read(options, log), cancel, log, out);
}

void convertContent(const Options& options, const EsvrFile& file, const CancelToken& cancel,
                    const cli::Log& log, std::ostream& out) {
  const auto chosen = writable(chooseGrids(options.input, file, options.grids), options, log);
  std::vector<ComparedGrid> compared;
  if (options.reference) compared = counterparts(file, chosen, options);
  const auto grids = decodeAll(file, chosen, options, log);
  if (cancel.cancelled()) throw Cancelled();
  tellLostMetadata(file, grids, options, log);
  writeGrids(options.output, file.metadata, inOrder(file, chosen, grids), options.write);
  if (options.reference) printErrors(options, compared, out);
}

}  // namespace esvr::esvr2vdb
