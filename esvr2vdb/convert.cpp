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

EsvrFile read(const Options& options, const cli::Log& log) {
  const ReadLimits limits{options.memory.maxBytes, options.memory.voxels};
  if (readsAll(options)) return readEsvr(options.input, limits);
  ReadPart wanted = options.part;
  wanted.limits = limits;
  PartOfFile part = readEsvrPart(options.input, wanted);
  log.info("read " + std::to_string(part.bytesRead) + " of " +
           std::to_string(std::filesystem::file_size(options.input)) + " bytes");
  return std::move(part.file);
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

std::vector<VolumeGrid> decodeAll(const EsvrFile& file, const std::vector<std::size_t>& chosen,
                                  const Options& options, const cli::Log& log) {
  std::vector<VolumeGrid> grids;
  DecodeOptions decode = options.decode;
  decode.maxBytes = options.memory.maxBytes;
  decode.memory = options.memory.voxels;
  for (const std::size_t g : chosen) {
    grids.push_back(decoded(file.grids[g], options, decode));
    tellEmpty(grids.back(), log);
    // All grids are in memory, and twice while they are written.
    decode.maxBytes -= std::min(decode.maxBytes, 2 * bytesOf(grids.back().volume));
  }
  return grids;
}

/// Warns that a NanoVDB file cannot hold metadata.
void tellLostMetadata(const EsvrFile& file, const std::vector<VolumeGrid>& grids,
                      const Options& options, const cli::Log& log) {
  if (options.output.extension() != ".nvdb") return;
  std::size_t items = file.metadata.size();
  for (const auto& grid : grids) items += grid.descriptor.metadata.size();
  if (items == 0) return;
  log.warning(options.output.string() + ": a NanoVDB file holds no metadata; " +
              std::to_string(items) + " items of " + options.input.string() + " are left out");
}

/// Finds each grid in the reference, before anything is written.
std::vector<ComparedGrid> counterparts(const EsvrFile& file, const std::vector<std::size_t>& chosen,
                                       const Options& options) {
  const auto names = uniqueNames(file);
  EsvrFile written;
  for (const std::size_t g : chosen)
    written.grids.emplace_back().descriptor = file.grids[g].descriptor;
  const auto writtenNames = uniqueNames(written);
  std::vector<std::string> referenceNames;
  for (const auto& grid : inspectVdb(*options.reference).grids) referenceNames.push_back(grid.name);
  std::vector<ComparedGrid> grids;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    (void)findGrid(referenceNames, names[chosen[i]], *options.reference);
    grids.push_back({names[chosen[i]], writtenNames[i]});
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
  const auto chosen = chooseGrids(options.input, file, options.grids);
  std::vector<ComparedGrid> compared;
  if (options.reference) compared = counterparts(file, chosen, options);
  const auto grids = decodeAll(file, chosen, options, log);
  if (cancel.cancelled()) throw Cancelled();
  tellLostMetadata(file, grids, options, log);
  writeGrids(options.output, file.metadata, grids, options.write);
  if (options.reference) printErrors(options, compared, out);
}

}  // namespace esvr::esvr2vdb
