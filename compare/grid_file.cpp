#include "compare/grid_file.h"

#include <utility>

#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "programs/option_values.h"

namespace esvr::compare {

// The grids of a file.

namespace {

constexpr std::uint64_t kVolumes = 2;  // the reference and the candidate

ListedGrid listedGrid(const EsvrFile& file, const GridOfFile& place) {
  if (place.isVector) {
    const StoredVector& vector = file.vectors[place.index];
    const StoredGrid& first = componentsOf(file, vector).front();
    const bool ofDoubles = first.descriptor.valueType == ValueType::kDouble;
    return {.name = vector.name,
            .comparable = false,
            .empty = first.activeVoxels == 0,
            .valueType = ofDoubles ? "vec3d" : "vec3s",  // OpenVDB's names of the source's types
            .ofEsvr = place,
            .isVector = true};
  }
  if (place.isCarried) {
    const GridSummary summary = inspectCarried(file.carried[place.index]);
    return {.name = file.carried[place.index].name,
            .comparable = summary.isScalar,
            .empty = summary.activeVoxels == 0,
            .valueType = summary.valueType,
            .ofEsvr = place,
            .isVector = summary.isVector};
  }
  const StoredGrid& grid = file.grids[place.index];
  return {.name = grid.descriptor.name,
          .empty = grid.activeVoxels == 0,
          .valueType = cli::nameOf(grid.descriptor.valueType),
          .ofEsvr = place};
}

}  // namespace

GridFile::GridFile(std::filesystem::path path, cli::HostMemory memory)
    : path_(std::move(path)), watched_({path_}), memory_(std::move(memory)) {
  if (path_.extension() != ".esvr") {
    listVdb();
    return;
  }
  esvr_ = std::make_unique<EsvrFile>(readEsvr(path_, {memory_.maxBytes, memory_.voxels}));
  bytes_ = inspectEsvr(path_).fileBytes;
  watched_.requireUnchanged();
  listEsvr();
}

GridFile::GridFile(std::filesystem::path path, const EsvrFile& frame, cli::HostMemory memory)
    : path_(std::move(path)), memory_(std::move(memory)), esvr_(std::make_unique<EsvrFile>(frame)) {
  listEsvr();
}

void GridFile::listEsvr() {
  metadata_ = esvr_->metadata;
  for (const auto& grid : gridsInOrder(*esvr_)) grids_.push_back(listedGrid(*esvr_, grid));
  traits_ = cli::traitsOf(*esvr_);
  nameGrids();
}

void GridFile::nameGrids() {
  std::vector<std::string> names;
  for (const auto& grid : grids_) names.push_back(grid.name);
  names_.emplace(std::move(names));
  for (std::size_t g = 0; g < grids_.size(); ++g) grids_[g].uniqueName = names_->unique(g);
}

void GridFile::listVdb() {
  VdbSummary summary = inspectVdb(path_);
  bytes_ = summary.fileBytes;
  metadata_ = std::move(summary.metadata);
  directory_ = summary.directory;
  for (const auto& grid : summary.grids) {
    grids_.push_back({.name = grid.name,
                      .comparable = grid.isScalar,
                      .empty = grid.activeVoxels == 0,
                      .valueType = grid.valueType,
                      .storedBytes = grid.storedBytes,
                      .isVector = grid.isVector});
    whyNoBytes_.push_back(grid.whyNotCarried);
  }
  traits_ = cli::traitsOf(summary);
  nameGrids();
}

std::size_t GridFile::find(const std::string& name) const { return names_->findWhole(name, path_); }

std::size_t GridFile::firstWithVoxels() const {
  for (std::size_t g = 0; g < grids_.size(); ++g)
    if (grids_[g].comparable && !grids_[g].empty) return g;
  throw BadInput(path_.string() + ": no grid of type float or double has an active voxel");
}

bool GridFile::hasBytes(std::size_t g) const {
  return esvr_ ? grids_[g].ofEsvr.isCarried : whyNoBytes_[g].empty();
}

std::optional<CarriedGrid> GridFile::bytesOf(std::size_t g) const {
  if (!hasBytes(g)) return std::nullopt;
  if (esvr_) return esvr_->carried[grids_[g].ofEsvr.index];
  auto grids = readCarried(path_, {&g, 1}, reading());
  return ofSameFile(std::move(grids.front()));
}

ReadOptions GridFile::reading() const {
  return {.nonFinite = NonFinite::kKeep,
          .maxBytes = memory_.maxBytes,
          .memory = memory_.voxels,
          .volumes = kVolumes,
          .directory = directory_};
}

VolumeGrid GridFile::read(std::size_t g) const {
  ReadOptions options = reading();
  options.allowEmpty = true;
  if (!esvr_) return ofSameFile(readGrid(path_, g, options));
  const GridOfFile& place = grids_[g].ofEsvr;
  if (place.isCarried) return readGrid(esvr_->carried[place.index], options);
  VolumeGrid grid;
  grid.descriptor = esvr_->grids.at(place.index).descriptor;
  grid.volume = decodeGrid(esvr_->grids[place.index],
                           {.maxBytes = memory_.maxBytes, .memory = memory_.voxels});
  return grid;
}

VectorGrid GridFile::readVectors(std::size_t g) const {
  if (!esvr_) return ofSameFile(readVector(path_, g, reading()));
  const GridOfFile& place = grids_[g].ofEsvr;
  if (place.isCarried) return readVector(esvr_->carried[place.index], reading());
  const StoredVector& vector = esvr_->vectors.at(place.index);
  return decodeVector(vector.name, componentsOf(*esvr_, vector),
                      {.maxBytes = memory_.maxBytes, .memory = memory_.voxels});
}

// The frames of a sequence.

std::unique_ptr<FrameSource> FrameSource::in(const std::string& path,
                                             const cli::HostMemory& memory) {
  const auto stored = cli::framesInFile(path);
  const auto pattern = cli::FramePattern::ofInput(path);
  if (!stored && !pattern) return nullptr;
  std::unique_ptr<FrameSource> source(
      new FrameSource(pattern ? *pattern : cli::FramePattern::whole(path), memory));
  if (!stored) {
    source->listing_ = cli::framesOnDisk(*pattern);
    return source;
  }
  source->listing_.frames = *stored;
  source->reader_ =
      std::make_unique<SequenceReader>(path, ReadLimits{memory.maxBytes, memory.voxels});
  return source;
}

GridFile FrameSource::open(cli::FrameNumber number) {
  const std::filesystem::path path = pattern_.toRead(number);
  if (!reader_) return GridFile(path, memory_);
  return GridFile(path, reader_->read(number), memory_);
}

std::uint64_t FrameSource::bytesOf(const std::vector<cli::FrameNumber>& frames) const {
  if (reader_) return reader_->fileBytes();
  std::uint64_t bytes = 0;
  for (const cli::FrameNumber frame : frames)
    bytes += std::filesystem::file_size(pattern_.toRead(frame));
  return bytes;
}

}  // namespace esvr::compare
