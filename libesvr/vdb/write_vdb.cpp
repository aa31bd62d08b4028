#include "vdb/write_vdb.h"

#include "vdb/versions.h"

#include <openvdb/io/Archive.h>
#include <openvdb/openvdb.h>

#include <fstream>

#include "vdb/metadata.h"
#include "vdb/volume_to_tree.h"

namespace esvr::vdb {
namespace {

constexpr const char* kWriterKey = "esvr_writer";
constexpr const char* kWriter = "esvr " ESVR_VERSION;

/// OpenVDB's own File writes to a stream whose errors nobody looks at; this one takes ours, which
/// throws.
class StreamArchive : public openvdb::io::Archive {
 public:
  StreamArchive() {
    using namespace openvdb::io;
    setCompression(COMPRESS_ACTIVE_MASK | (hasBloscCompression() ? COMPRESS_BLOSC : COMPRESS_ZIP));
  }
  void writeTo(std::ostream& stream, const openvdb::GridPtrVec& grids,
               const openvdb::MetaMap& metadata) const {
    constexpr bool kSeekable = true;
    Archive::write(stream, grids, kSeekable, metadata);
  }
};

}  // namespace

std::vector<MetaItem> withWriter(std::span<const MetaItem> fileMetadata) {
  std::vector<MetaItem> items(fileMetadata.begin(), fileMetadata.end());
  if (!findItem(items, kWriterKey)) items.push_back(stringItem(kWriterKey, kWriter));
  return items;
}

void writeOpenVdb(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                  std::span<const VolumeGrid> grids, const WriteOptions& options) {
  openvdb::GridPtrVec openVdbGrids;
  for (const auto& grid : grids) openVdbGrids.push_back(makeOpenVdbGrid(grid, options));
  openvdb::MetaMap metadata;
  insertItems(withWriter(fileMetadata), metadata);

  std::ofstream stream(path, std::ios::binary);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  StreamArchive().writeTo(stream, openVdbGrids, metadata);
  stream.close();
}

}  // namespace esvr::vdb
