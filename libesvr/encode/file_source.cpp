// Which grids of a .vdb file are converted and which are carried, and how they are read.
#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "esvr/convert_file.h"
#include "esvr/error.h"

namespace esvr {
namespace {

CarriedGrid readOneCarried(const std::filesystem::path& path, std::size_t place,
                           const ReadOptions& read) {
  return std::move(readCarried(path, std::span(&place, 1), read).front());
}

GridSource sourceOf(const std::filesystem::path& path, const GridSummary& grid, std::size_t place,
                    const ReadOptions& read) {
  GridSource source{.name = grid.name,
                    .place = place,
                    .activeVoxels = grid.activeVoxels,
                    .storedBytes = grid.storedBytes,
                    .activeBox = grid.activeBox,
                    .read = [=] { return readGrid(path, place, read); }};
  return source;
}

GridSource componentOf(const std::filesystem::path& path, const GridSummary& grid,
                       std::size_t place, std::size_t component, const ReadOptions& read) {
  GridSource source = sourceOf(path, grid, place, read);
  source.component = component;
  source.read = [=] { return readComponent(path, place, component, read); };
  if (component > 0) return source;
  source.readVector = [=] { return readVector(path, place, read); };
  if (grid.whyNotCarried.empty())
    source.readCarried = [=] { return readOneCarried(path, place, read); };
  return source;
}

/// True if a grid has inactive values that a converted grid loses.
bool losesValues(const std::filesystem::path& path, const VdbSummary& summary, std::size_t place,
                 const ReadOptions& read) {
  return summary.grids[place].isVector ? readVector(path, place, read).inactive.count() > 0
                                       : readGrid(path, place, read).inactive.count() > 0;
}

}  // namespace

std::string whyCarried(const GridSummary& grid, bool lossless) {
  if (!grid.skipReason.empty() && !grid.isVector) return grid.skipReason;
  const bool isDouble = grid.valueType == "double" || grid.valueType == "vec3d";
  return lossless && isDouble && grid.whyNotCarried.empty()
             ? "its values are doubles, which a lossless file cannot hold in another way"
             : "";
}

FileSource readSources(const std::filesystem::path& path, const VdbSummary& summary,
                       const FileChoice& choice, ReadOptions read) {
  read.directory = summary.directory;
  FileSource source{.metadata = summary.metadata};
  if (!choice.carried.empty()) source.carried = readCarried(path, choice.carried, read);
  for (const CarriedGrid& grid : source.carried)
    if (const std::uint64_t bytes = grid.bytes.size(); !read.memory.isInFile(bytes))
      read.maxBytes -= std::min(read.maxBytes, bytes);
  for (const std::size_t place : choice.converted) {
    const GridSummary& grid = summary.grids.at(place);
    if (!grid.isVector) source.grids.push_back(sourceOf(path, grid, place, read));
    for (std::size_t c = 0; grid.isVector && c < kComponents; ++c)
      source.grids.push_back(componentOf(path, grid, place, c, read));
  }
  return source;
}

FileSource readSources(const std::filesystem::path& path, bool lossless, const ReadOptions& read) {
  const VdbSummary summary = inspectVdb(path);
  FileChoice choice;
  for (std::size_t place = 0; place < summary.grids.size(); ++place) {
    const GridSummary& grid = summary.grids[place];
    const std::string why = whyCarried(grid, lossless);
    const bool isCarried = !why.empty() || (lossless && grid.whyNotCarried.empty() &&
                                            losesValues(path, summary, place, read));
    if (isCarried && !grid.whyNotCarried.empty())
      throw BadInput(path.string() + ": grid \"" + grid.uniqueName + "\" can be neither fitted (" +
                     why + ") nor carried (" + grid.whyNotCarried + ')');
    (isCarried ? choice.carried : choice.converted).push_back(place);
  }
  return readSources(path, summary, choice, read);
}

}  // namespace esvr
