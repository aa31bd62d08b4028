#include "vdb/write_vdb.h"

#include "vdb/versions.h"

#include <openvdb/openvdb.h>

#include <fstream>

#include "vdb/archive_writer.h"
#include "vdb/metadata.h"
#include "vdb/volume_to_tree.h"

namespace esvr::vdb {
namespace {

constexpr const char* kWriter = "esvr " ESVR_VERSION;

std::uint32_t bestCompression() {
  using namespace openvdb::io;
  return COMPRESS_ACTIVE_MASK | (Archive::hasBloscCompression() ? COMPRESS_BLOSC : COMPRESS_ZIP);
}

struct NameOf {
  const std::string& operator()(const CarriedGrid* grid) const { return grid->name; }
  const std::string& operator()(const VolumeGrid* grid) const { return grid->descriptor.name; }
  const std::string& operator()(const VectorGrid* grid) const { return grid->descriptor.name; }
  const std::string& operator()(const PackedGrid* grid) const { return grid->descriptor.name; }
};

/// Adds a grid of any kind to a file.
struct AddTo {
  ArchiveWriter& writer;
  const WriteOptions& options;

  void operator()(const CarriedGrid* grid) const { writer.add(*grid); }
  void operator()(const VolumeGrid* grid) const {
    writer.add(makeOpenVdbGrid(*grid, options, LeafVoxels::kWhenWritten));
  }
  void operator()(const VectorGrid* grid) const { writer.add(makeOpenVdbGrid(*grid, options)); }
  void operator()(const PackedGrid* grid) const { writer.add(makeOpenVdbGrid(*grid, options)); }
};

}  // namespace

std::vector<MetaItem> withWriter(std::span<const MetaItem> fileMetadata) {
  std::vector<MetaItem> items(fileMetadata.begin(), fileMetadata.end());
  if (!findItem(items, kWriterKey)) items.push_back(stringItem(kWriterKey, kWriter));
  return items;
}

void writeOpenVdb(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                  std::span<const GridToWrite> grids, const WriteOptions& options) {
  openvdb::initialize();
  openvdb::MetaMap metadata;
  insertItems(withWriter(fileMetadata), metadata);
  std::vector<std::string> names;
  for (const auto& grid : grids) names.push_back(std::visit(NameOf{}, grid));

  std::ofstream stream(path, std::ios::binary);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  ArchiveWriter writer(stream, bestCompression(), metadata, std::move(names));
  for (const auto& grid : grids) std::visit(AddTo{writer, options}, grid);
  stream.close();
}

}  // namespace esvr::vdb
