#include "vdb/write_vdb.h"

#include "vdb/versions.h"

#include <openvdb/openvdb.h>

#include <fstream>

#include "vdb/metadata.h"
#include "vdb/stream_archive.h"
#include "vdb/volume_to_tree.h"

namespace esvr::vdb {
namespace {

constexpr const char* kWriter = "esvr " ESVR_VERSION;

std::uint32_t bestCompression() {
  using namespace openvdb::io;
  return COMPRESS_ACTIVE_MASK | (Archive::hasBloscCompression() ? COMPRESS_BLOSC : COMPRESS_ZIP);
}

}  // namespace

std::vector<MetaItem> withWriter(std::span<const MetaItem> fileMetadata) {
  std::vector<MetaItem> items(fileMetadata.begin(), fileMetadata.end());
  if (!findItem(items, kWriterKey)) items.push_back(stringItem(kWriterKey, kWriter));
  return items;
}

void writeOpenVdb(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                  std::span<const VolumeGrid> grids, const WriteOptions& options) {
  openvdb::GridPtrVec openVdbGrids;
  for (const auto& grid : grids)
    openVdbGrids.push_back(makeOpenVdbGrid(grid, options, LeafVoxels::kWhenWritten));
  openvdb::MetaMap metadata;
  insertItems(withWriter(fileMetadata), metadata);

  std::ofstream stream(path, std::ios::binary);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  StreamArchive(bestCompression()).writeTo(stream, openVdbGrids, metadata);
  stream.close();
}

}  // namespace esvr::vdb
