#include "esvr/vdb_io.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "core/atomic_file.h"
#include "core/counted.h"
#include "core/read_input.h"
#include "esvr/error.h"
#include "vdb/archive.h"
#include "vdb/files.h"
#include "vdb/formats.h"
#include "vdb/write_nvdb.h"

namespace esvr::vdb {
namespace {

enum class FileFormat { kOpenVdb, kNanoVdb };

FileFormat formatOf(InputFile& file) {
  if (beginsAsVdb(file)) return FileFormat::kOpenVdb;
  if (beginsAsNanoVdb(file)) return FileFormat::kNanoVdb;
  throw BadInput("is neither an OpenVDB nor a NanoVDB file");
}

/// Opens a file and reads from it. Its parts are read at different times and fit together only if
/// it has not changed meanwhile; after a change, an error may also come from the mixture.
template <class Read>
auto readingFrom(const std::filesystem::path& path, const Read& read) {
  const WatchedInputs watched({path});
  try {
    auto result = whileReading(path, [&] {
      InputFile file(path);
      return read(file);
    });
    watched.requireUnchanged();
    return result;
  } catch (const BadInput&) {
    watched.requireUnchanged();
    throw;
  }
}

/// Options whose directory is that of the file as it is now, or none.
ReadOptions currently(const std::filesystem::path& path, ReadOptions options) {
  if (options.directory && options.directory->stamp != stampOf(path)) options.directory = nullptr;
  return options;
}

FileFormat formatNamedBy(const std::filesystem::path& path) {
  if (path.extension() == ".vdb") return FileFormat::kOpenVdb;
  if (path.extension() == ".nvdb") return FileFormat::kNanoVdb;
  throw UsageError(path.string() + ": the extension must be .vdb or .nvdb");
}

std::vector<std::string> storedNames(const VdbSummary& summary) {
  std::vector<std::string> names;
  for (const GridSummary& grid : summary.grids) names.push_back(grid.name);
  return names;
}

/// Finds a grid that a user has named.
NamedGrid namedIn(const std::filesystem::path& path, const std::string& name) {
  return GridNames(storedNames(inspectVdb(path))).find(name, path);
}

/// The place of a grid that a user has named, of which components cannot be read.
std::size_t placeIn(const std::filesystem::path& path, const std::string& name) {
  const NamedGrid grid = namedIn(path, name);
  if (grid.component)
    throw BadInput(path.string() + ": \"" + shownName(name) +
                   "\" is a component, which has no components of its own");
  return grid.place;
}

}  // namespace

void requireGrid(std::size_t place, std::size_t grids) {
  if (place < grids) return;
  throw BadInput("has no grid number " + std::to_string(place + 1) + ", only " +
                 counted(grids, "grid"));
}

VectorGrid joinedComponents(
    ReadOptions options,
    const std::function<VolumeGrid(std::size_t component, const ReadOptions& options)>& read) {
  VectorGrid vectors;
  for (std::size_t c = 0; c < kComponents; ++c) {
    VolumeGrid component = read(c, options);
    const std::uint64_t bytes = component.volume.values.size() * sizeof(float);
    if (!options.memory.isInFile(bytes)) options.maxBytes -= std::min(options.maxBytes, bytes);
    vectors.background[c] = component.descriptor.background;
    if (c == 0) vectors.descriptor = std::move(component.descriptor);
    vectors.components[c] = std::move(component.volume);
    vectors.nonFiniteReplaced += component.nonFiniteReplaced;
    vectors.inactive.add(component.inactive.ofComponent(c));
    vectors.narrowing[c] = component.narrowing;
  }
  return vectors;
}

std::string notAFloatType(const std::string& valueType) {
  return "its values are of type " + valueType + "; only float, half and double can be fitted";
}

}  // namespace esvr::vdb

namespace esvr {

VdbSummary inspectVdb(const std::filesystem::path& path) {
  const auto stamp = stampOf(path);
  return vdb::readingFrom(path, [&](vdb::InputFile& file) {
    VdbSummary summary = vdb::formatOf(file) == vdb::FileFormat::kOpenVdb
                             ? vdb::inspectOpenVdb(file)
                             : vdb::inspectNanoVdb(file);
    const GridNames names(vdb::storedNames(summary));
    for (std::size_t i = 0; i < names.size(); ++i) summary.grids[i].uniqueName = names.unique(i);
    if (summary.directory) {
      vdb::ArchiveDirectory stamped = *summary.directory;
      stamped.stamp = stamp;
      summary.directory = std::make_shared<const vdb::ArchiveDirectory>(std::move(stamped));
    }
    return summary;
  });
}

VolumeGrid readGrid(const std::filesystem::path& path, std::size_t place,
                    const ReadOptions& options) {
  return vdb::readingFrom(path, [&](vdb::InputFile& file) {
    return vdb::formatOf(file) == vdb::FileFormat::kOpenVdb
               ? vdb::readOpenVdbGrid(file, place, vdb::currently(path, options))
               : vdb::readNanoVdbGrid(file, place, options);
  });
}

VolumeGrid readGrid(const std::filesystem::path& path, const std::string& name,
                    const ReadOptions& options) {
  const NamedGrid grid = vdb::namedIn(path, name);
  return grid.component ? readComponent(path, grid.place, *grid.component, options)
                        : readGrid(path, grid.place, options);
}

PackedGrid readPacked(const std::filesystem::path& path, std::size_t place,
                      const ReadOptions& options) {
  return vdb::readingFrom(path, [&](vdb::InputFile& file) {
    if (vdb::formatOf(file) == vdb::FileFormat::kOpenVdb)
      return vdb::readOpenVdbPacked(file, place, vdb::currently(path, options));
    ReadOptions anyNumber = options;
    anyNumber.allowEmpty = true;
    const VdbSummary summary = vdb::inspectNanoVdb(file);
    vdb::requireGrid(place, summary.grids.size());
    if (summary.grids[place].isVector)
      return packed(vdb::readNanoVdbVector(file, place, anyNumber));
    const VolumeGrid grid = vdb::readNanoVdbGrid(file, place, anyNumber);
    return packed(grid.descriptor, grid.volume);
  });
}

PackedGrid readPacked(const std::filesystem::path& path, const std::string& name,
                      const ReadOptions& options) {
  const NamedGrid grid = vdb::namedIn(path, name);
  if (!grid.component) return readPacked(path, grid.place, options);
  const VolumeGrid volume = readComponent(path, grid.place, *grid.component, options);
  return packed(volume.descriptor, volume.volume);
}

VolumeGrid readComponent(const std::filesystem::path& path, std::size_t place,
                         std::size_t component, const ReadOptions& options) {
  return vdb::readingFrom(path, [&](vdb::InputFile& file) {
    return vdb::formatOf(file) == vdb::FileFormat::kOpenVdb
               ? vdb::readOpenVdbComponent(file, place, component, vdb::currently(path, options))
               : vdb::readNanoVdbComponent(file, place, component, options);
  });
}

VolumeGrid readComponent(const std::filesystem::path& path, const std::string& name,
                         std::size_t component, const ReadOptions& options) {
  return readComponent(path, vdb::placeIn(path, name), component, options);
}

VectorGrid readVector(const std::filesystem::path& path, std::size_t place,
                      const ReadOptions& options) {
  return vdb::readingFrom(path, [&](vdb::InputFile& file) {
    return vdb::formatOf(file) == vdb::FileFormat::kOpenVdb
               ? vdb::readOpenVdbVector(file, place, vdb::currently(path, options))
               : vdb::readNanoVdbVector(file, place, options);
  });
}

VectorGrid readVector(const std::filesystem::path& path, const std::string& name,
                      const ReadOptions& options) {
  return readVector(path, vdb::placeIn(path, name), options);
}

std::vector<CarriedGrid> readCarried(const std::filesystem::path& path,
                                     std::span<const std::size_t> places,
                                     const ReadOptions& options) {
  return vdb::readingFrom(path, [&](vdb::InputFile& file) {
    return vdb::readOpenVdbCarried(file, places, vdb::currently(path, options));
  });
}

void writeGrids(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                std::span<const VolumeGrid> grids, const WriteOptions& options) {
  std::vector<GridToWrite> all;
  for (const auto& grid : grids) all.emplace_back(&grid);
  writeGrids(path, fileMetadata, all, options);
}

void writeGrids(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                std::span<const GridToWrite> grids, const WriteOptions& options) {
  const vdb::FileFormat format = vdb::formatNamedBy(path);
  AtomicFile file(path, options.overwrite);
  vdb::whileWriting(path, [&] {
    if (format == vdb::FileFormat::kOpenVdb)
      vdb::writeOpenVdb(file.path(), fileMetadata, grids, options);
    else
      vdb::writeNanoVdb(file.path(), grids, options);
  });
  file.commit();
}

}  // namespace esvr
