#include "core/atomic_file.h"
#include "core/read_input.h"
#include "esvr/error.h"
#include "vdb/archive.h"
#include "vdb/carry.h"
#include "vdb/errors.h"
#include "vdb/nano_file.h"
#include "vdb/open_vdb.h"
#include "vdb/read_nvdb.h"
#include "vdb/read_vdb.h"
#include "vdb/write_nvdb.h"
#include "vdb/write_vdb.h"

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

FileFormat formatNamedBy(const std::filesystem::path& path) {
  if (path.extension() == ".vdb") return FileFormat::kOpenVdb;
  if (path.extension() == ".nvdb") return FileFormat::kNanoVdb;
  throw UsageError(path.string() + ": the extension must be .vdb or .nvdb");
}

}  // namespace

VdbSummary OpenVdb::inspectVdb(const std::filesystem::path& path) const {
  return readingFrom(path, [&](InputFile& file) {
    return formatOf(file) == FileFormat::kOpenVdb ? inspectOpenVdb(file) : inspectNanoVdb(file);
  });
}

VolumeGrid OpenVdb::readGrid(const std::filesystem::path& path, std::size_t place,
                             const ReadOptions& options) const {
  return readingFrom(path, [&](InputFile& file) {
    return formatOf(file) == FileFormat::kOpenVdb ? readOpenVdbGrid(file, place, options)
                                                  : readNanoVdbGrid(file, place, options);
  });
}

namespace {

/// Opens a file whose grids may be vectors. NanoVDB's vectors are not read.
template <class Read>
auto readVectors(const std::filesystem::path& path, const Read& read) {
  return readingFrom(path, [&](InputFile& file) {
    if (formatOf(file) != FileFormat::kOpenVdb)
      throw BadInput("is a NanoVDB file, whose grids of vectors cannot be read");
    return read(file);
  });
}

}  // namespace

VolumeGrid OpenVdb::readComponent(const std::filesystem::path& path, std::size_t place,
                                  std::size_t component, const ReadOptions& options) const {
  return readVectors(
      path, [&](InputFile& file) { return readOpenVdbComponent(file, place, component, options); });
}

VectorGrid OpenVdb::readVector(const std::filesystem::path& path, std::size_t place,
                               const ReadOptions& options) const {
  return readVectors(path,
                     [&](InputFile& file) { return readOpenVdbVector(file, place, options); });
}

PackedGrid OpenVdb::readPacked(const std::filesystem::path& path, std::size_t place,
                               const ReadOptions& options) const {
  return readingFrom(path, [&](InputFile& file) {
    if (formatOf(file) == FileFormat::kOpenVdb) return readOpenVdbPacked(file, place, options);
    ReadOptions anyNumber = options;
    anyNumber.allowEmpty = true;
    const VolumeGrid grid = readNanoVdbGrid(file, place, anyNumber);
    return packed(grid.descriptor, grid.volume);
  });
}

std::vector<CarriedGrid> OpenVdb::readCarried(const std::filesystem::path& path,
                                              std::span<const std::size_t> places,
                                              const ReadOptions& options) const {
  return readingFrom(path,
                     [&](InputFile& file) { return readOpenVdbCarried(file, places, options); });
}

void OpenVdb::writeGrids(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                         std::span<const GridToWrite> grids, const WriteOptions& options) const {
  const FileFormat format = formatNamedBy(path);
  AtomicFile file(path, options.overwrite);
  whileWriting(path, [&] {
    if (format == FileFormat::kOpenVdb)
      writeOpenVdb(file.path(), fileMetadata, grids, options);
    else
      writeNanoVdb(file.path(), grids, options);
  });
  file.commit();
}

}  // namespace esvr::vdb
