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

const std::string& nameOf(const GridToWrite& grid) {
  if (const auto* carried = std::get_if<const CarriedGrid*>(&grid)) return (*carried)->name;
  return std::get<const VolumeGrid*>(grid)->descriptor.name;
}

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
  for (const auto& grid : grids) names.push_back(nameOf(grid));

  std::ofstream stream(path, std::ios::binary);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  ArchiveWriter writer(stream, bestCompression(), metadata, std::move(names));
  for (const auto& grid : grids) {
    if (const auto* carried = std::get_if<const CarriedGrid*>(&grid))
      writer.add(**carried);
    else
      writer.add(
          makeOpenVdbGrid(*std::get<const VolumeGrid*>(grid), options, LeafVoxels::kWhenWritten));
  }
  stream.close();
}

}  // namespace esvr::vdb
