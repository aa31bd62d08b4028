#include "esvr/vdb_io.h"

#include "core/atomic_file.h"
#include "esvr/error.h"
#include "vdb/archive.h"
#include "vdb/carry.h"
#include "vdb/errors.h"
#include "vdb/nano_file.h"
#include "vdb/read_nvdb.h"
#include "vdb/read_vdb.h"
#include "vdb/write_nvdb.h"
#include "vdb/write_vdb.h"

namespace esvr {
namespace {

enum class FileFormat { kOpenVdb, kNanoVdb };

FileFormat formatOf(vdb::InputFile& file) {
  if (vdb::beginsAsVdb(file)) return FileFormat::kOpenVdb;
  if (vdb::beginsAsNanoVdb(file)) return FileFormat::kNanoVdb;
  throw BadInput("is neither an OpenVDB nor a NanoVDB file");
}

FileFormat formatNamedBy(const std::filesystem::path& path) {
  if (path.extension() == ".vdb") return FileFormat::kOpenVdb;
  if (path.extension() == ".nvdb") return FileFormat::kNanoVdb;
  throw UsageError(path.string() + ": the extension must be .vdb or .nvdb");
}

}  // namespace

VdbSummary inspectVdb(const std::filesystem::path& path) {
  return vdb::whileReading(path, [&] {
    vdb::InputFile file(path);
    return formatOf(file) == FileFormat::kOpenVdb ? vdb::inspectOpenVdb(file)
                                                  : vdb::inspectNanoVdb(file);
  });
}

VolumeGrid readGrid(const std::filesystem::path& path, const std::string& name,
                    const ReadOptions& options) {
  return vdb::whileReading(path, [&] {
    vdb::InputFile file(path);
    return formatOf(file) == FileFormat::kOpenVdb ? vdb::readOpenVdbGrid(file, name, options)
                                                  : vdb::readNanoVdbGrid(file, name, options);
  });
}

namespace {

/// Opens a file whose grids may be vectors. NanoVDB's vectors are not read.
template <class Read>
auto readVectors(const std::filesystem::path& path, const Read& read) {
  return vdb::whileReading(path, [&] {
    vdb::InputFile file(path);
    if (formatOf(file) != FileFormat::kOpenVdb)
      throw BadInput("is a NanoVDB file, whose grids of vectors cannot be read");
    return read(file);
  });
}

}  // namespace

VolumeGrid readComponent(const std::filesystem::path& path, const std::string& name,
                         std::size_t component, const ReadOptions& options) {
  return readVectors(path, [&](vdb::InputFile& file) {
    return vdb::readOpenVdbComponent(file, name, component, options);
  });
}

VectorGrid readVector(const std::filesystem::path& path, const std::string& name,
                      const ReadOptions& options) {
  return readVectors(
      path, [&](vdb::InputFile& file) { return vdb::readOpenVdbVector(file, name, options); });
}

std::vector<CarriedGrid> readCarried(const std::filesystem::path& path,
                                     std::span<const std::size_t> places,
                                     const ReadOptions& options) {
  return vdb::whileReading(path, [&] {
    vdb::InputFile file(path);
    return vdb::readOpenVdbCarried(file, places, options);
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
  const FileFormat format = formatNamedBy(path);
  AtomicFile file(path, options.overwrite);
  vdb::whileWriting(path, [&] {
    if (format == FileFormat::kOpenVdb)
      vdb::writeOpenVdb(file.path(), fileMetadata, grids, options);
    else
      vdb::writeNanoVdb(file.path(), grids, options);
  });
  file.commit();
}

}  // namespace esvr
