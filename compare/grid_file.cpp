#include "compare/grid_file.h"

#include <utility>

#include "cli/names.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/grid_names.h"

namespace esvr::compare {
namespace {

std::vector<std::string> storedNames(const std::vector<ListedGrid>& grids) {
  std::vector<std::string> names;
  for (const auto& grid : grids) names.push_back(grid.name);
  return names;
}

ListedGrid listedGrid(const StoredGrid& grid) {
  return {.name = grid.descriptor.name,
          .empty = grid.activeVoxels == 0,
          .valueType = cli::nameOf(grid.descriptor.valueType)};
}

ListedGrid listedGrid(const CarriedGrid& grid) {
  const GridSummary summary = inspectCarried(grid);
  return {.name = grid.name,
          .comparable = summary.isScalar,
          .empty = summary.activeVoxels == 0,
          .valueType = summary.valueType};
}

}  // namespace

GridFile::GridFile(std::filesystem::path path, cli::HostMemory memory)
    : path_(std::move(path)), memory_(std::move(memory)) {
  if (path_.extension() == ".esvr")
    listEsvr();
  else
    listVdb();
}

void GridFile::listEsvr() {
  esvr_ = std::make_unique<EsvrFile>(readEsvr(path_, {memory_.maxBytes, memory_.voxels}));
  bytes_ = inspectEsvr(path_).fileBytes;
  metadata_ = esvr_->metadata;
  for (const auto& grid : gridsInOrder(*esvr_)) {
    grids_.push_back(grid.isCarried ? listedGrid(esvr_->carried[grid.index])
                                    : listedGrid(esvr_->grids[grid.index]));
    grids_.back().ofEsvr = grid;
  }
  const auto unique = uniqueNames(storedNames(grids_));
  for (std::size_t g = 0; g < grids_.size(); ++g) grids_[g].uniqueName = unique[g];
}

void GridFile::listVdb() {
  VdbSummary summary = inspectVdb(path_);
  bytes_ = summary.fileBytes;
  metadata_ = std::move(summary.metadata);
  for (const auto& grid : summary.grids) {
    grids_.push_back(
        {grid.name, grid.uniqueName, grid.isScalar, grid.activeVoxels == 0, grid.valueType});
    whyNoBytes_.push_back(grid.whyNotCarried);
  }
}

std::size_t GridFile::find(const std::string& name) const {
  return findGrid(storedNames(grids_), name, path_);
}

std::size_t GridFile::firstWithVoxels() const {
  for (std::size_t g = 0; g < grids_.size(); ++g)
    if (grids_[g].comparable && !grids_[g].empty) return g;
  throw BadInput(path_.string() + ": no grid of type float or double has an active voxel");
}

std::optional<CarriedGrid> GridFile::bytesOf(std::size_t g) const {
  const auto [isCarried, index] = grids_[g].ofEsvr;
  if (esvr_) return isCarried ? std::optional(esvr_->carried[index]) : std::nullopt;
  if (!whyNoBytes_[g].empty()) return std::nullopt;
  auto grids =
      readCarried(path_, {&g, 1}, {.maxBytes = memory_.maxBytes, .memory = memory_.voxels});
  return std::move(grids.front());
}

VolumeGrid GridFile::read(std::size_t g) const {
  const ReadOptions options{
      .allowEmpty = true, .maxBytes = memory_.maxBytes, .memory = memory_.voxels};
  if (!esvr_) return readGrid(path_, grids_[g].uniqueName, options);
  const auto [isCarried, index] = grids_[g].ofEsvr;
  if (isCarried) return readGrid(esvr_->carried[index], options);
  VolumeGrid grid;
  grid.descriptor = esvr_->grids[index].descriptor;
  grid.volume =
      decodeGrid(esvr_->grids[index], {.maxBytes = memory_.maxBytes, .memory = memory_.voxels});
  return grid;
}

}  // namespace esvr::compare
