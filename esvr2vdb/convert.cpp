#include <algorithm>
#include <filesystem>
#include <iostream>
#include <utility>

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

/// Checks everything that can be checked before the work begins.
void checkFiles(const Options& options) {
  std::vector<std::filesystem::path> files{options.input, options.output};
  if (options.reference) files.push_back(*options.reference);
  cli::requireDistinct(files);
  cli::checkOutput(options.output, {".vdb", ".nvdb"}, options.write.overwrite);
}

/// Why the output cannot hold carried grids; null if it can.
const char* whyNoCarried(const Options& options) {
  if (!readsAll(options)) return "--lod, --max-ellipsoids and --bbox cannot cut a carried grid";
  if (options.output.extension() == ".nvdb") return "a NanoVDB file cannot hold a carried grid";
  return nullptr;
}

EsvrFile read(const Options& options, const cli::Log& log) {
  const ReadLimits limits{options.memory.maxBytes, options.memory.voxels,
                          whyNoCarried(options) == nullptr};
  if (readsAll(options)) return readEsvr(options.input, limits);
  ReadPart wanted = options.part;
  wanted.limits = limits;
  PartOfFile part = readEsvrPart(options.input, wanted);
  log.info("read " + std::to_string(part.bytesRead) + " of " +
           std::to_string(std::filesystem::file_size(options.input)) + " bytes");
  return std::move(part.file);
}

/// The chosen grids that the output can hold. Says which of them are left out.
/// \throws UsageError  a grid that it cannot hold is named
/// \throws BadInput  no grid is left
std::vector<NamedGrid> writable(const std::vector<NamedGrid>& chosen, const Options& options,
                                const cli::Log& log) {
  const char* why = whyNoCarried(options);
  std::vector<NamedGrid> kept;
  for (const NamedGrid& grid : chosen) {
    if (!why || !grid.grid.isCarried) {
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

VolumeGrid decoded(const StoredGrid& grid, const Options& options, const DecodeOptions& decode) {
  VolumeGrid result;
  result.descriptor = grid.descriptor;
  result.volume = options.maxEllipsoids ? decodeGrid(heaviest(grid, *options.maxEllipsoids), decode)
                                        : decodeGrid(grid, decode);
  return result;
}

/// Bytes of a volume in memory.
std::uint64_t bytesOf(const SparseVolume& volume) {
  const std::uint64_t values = volume.values.size() * sizeof(float);
  return volume.brickCount() * (sizeof(BrickMask) + sizeof(Coord)) +
         (memoryOf(volume).isInFile(values) ? 0 : values);
}

void tellEmpty(const VolumeGrid& grid, const cli::Log& log) {
  if (activeVoxelCount(grid.volume) == 0)
    log.warning("grid \"" + grid.descriptor.name + "\" comes back without an active voxel");
}

/// The grids that are not carried, in order.
std::vector<VolumeGrid> decodeAll(const EsvrFile& file, const std::vector<NamedGrid>& chosen,
                                  const Options& options, const cli::Log& log) {
  std::vector<VolumeGrid> grids;
  DecodeOptions decode = options.decode;
  decode.maxBytes = options.memory.maxBytes;
  decode.memory = options.memory.voxels;
  for (const NamedGrid& named : chosen) {
    if (named.grid.isCarried) continue;
    grids.push_back(decoded(file.grids[named.grid.index], options, decode));
    tellEmpty(grids.back(), log);
    // All grids are in memory, and twice while they are written.
    decode.maxBytes -= std::min(decode.maxBytes, 2 * bytesOf(grids.back().volume));
  }
  return grids;
}

/// All chosen grids in order. \param decoded  those that are not carried
std::vector<GridToWrite> inOrder(const EsvrFile& file, const std::vector<NamedGrid>& chosen,
                                 const std::vector<VolumeGrid>& decoded) {
  std::vector<GridToWrite> all;
  auto next = decoded.begin();
  for (const auto& [grid, name] : chosen)
    all.push_back(grid.isCarried ? GridToWrite(&file.carried[grid.index]) : GridToWrite(&*next++));
  return all;
}

/// Warns that a NanoVDB file cannot hold metadata.
void tellLostMetadata(const EsvrFile& file, const std::vector<VolumeGrid>& grids,
                      const Options& options, const cli::Log& log) {
  if (options.output.extension() != ".nvdb") return;
  std::size_t items = file.metadata.size();
  for (const auto& grid : grids) items += grid.descriptor.metadata.size();
  if (items == 0) return;
  log.warning("a NanoVDB file holds no metadata, which is left out",
              std::to_string(items) + " items");
}

/// The names of the chosen grids in the output.
std::vector<std::string> writtenNames(const EsvrFile& file, const std::vector<NamedGrid>& chosen) {
  std::vector<std::string> names;
  for (const auto& [grid, name] : chosen)
    names.push_back(grid.isCarried ? file.carried[grid.index].name
                                   : file.grids[grid.index].descriptor.name);
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
    grids.push_back({chosen[i].name, written[i]});
  }
  return grids;
}

}  // namespace

void convert(const Options& options) {
  const cli::Interrupts interrupts;  // Ctrl-C lets a file that is being written be completed
  checkFiles(options);
  convertFile(options, interrupts.token(), cli::Log(kProgram, options.verbosity), std::cout);
}

void convertFile(const Options& options, const CancelToken& cancel, const cli::Log& log,
                 std::ostream& out) {
  const EsvrFile file = read(options, log);
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
