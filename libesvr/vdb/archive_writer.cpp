#include "vdb/archive_writer.h"

#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>

#include <algorithm>

#include "esvr/error.h"
#include "vdb/carry.h"

namespace esvr::vdb {
namespace {

constexpr bool kSeekable = true;

}  // namespace

ArchiveWriter::ArchiveWriter(std::ostream& stream, std::uint32_t compression,
                             const openvdb::MetaMap& metadata, std::vector<std::string> names)
    : stream_(stream),
      state_(std::make_shared<openvdb::io::StreamMetadata>()),
      names_(std::move(names)) {
  setCompression(compression);
  openvdb::io::setStreamMetadataPtr(stream_, state_, /*transfer=*/false);
  openvdb::io::setDataCompression(stream_, compression);
  openvdb::io::setWriteGridStatsMetadata(stream_, isGridStatsMetadataEnabled());
  writeHeader(stream_, kSeekable);
  metadata.writeMeta(stream_);
  const auto count = std::int32_t(names_.size());
  stream_.write(reinterpret_cast<const char*>(&count), sizeof count);
}

void ArchiveWriter::add(const openvdb::GridBase::ConstPtr& grid) {
  openvdb::io::GridDescriptor row(nextName(), grid->type(), grid->saveFloatAsHalf());
  writeGrid(row, grid, stream_, kSeekable);
  // Some flags of the compression depend on the grid.
  openvdb::io::setDataCompression(stream_, compression());
}

void ArchiveWriter::add(const CarriedGrid& grid) {
  if (const auto why = whyNotCarried(grid.treeType, grid.vdbVersion); !why.empty())
    throw RuntimeFailure("grid \"" + grid.name + "\" cannot be written: " + why);
  openvdb::io::GridDescriptor row(nextName(), grid.treeType, grid.savedAsHalf);
  row.writeHeader(stream_);
  constexpr std::int64_t kPositionBytes = 3 * sizeof(std::int64_t);
  const std::int64_t begin = std::int64_t(stream_.tellp()) + kPositionBytes;
  row.setGridPos(begin);
  row.setBlockPos(begin + std::int64_t(grid.blocksAt));
  row.setEndPos(begin + std::int64_t(grid.bytes.size()));
  row.writeStreamPos(stream_);
  stream_.write(reinterpret_cast<const char*>(grid.bytes.data()),
                std::streamsize(grid.bytes.size()));
}

std::string ArchiveWriter::nextName() {
  using openvdb::io::GridDescriptor;
  const std::string& name = names_.at(next_++);
  const bool isShared = std::count(names_.begin(), names_.end(), name) > 1;
  std::string unique = name.empty() || isShared ? GridDescriptor::addSuffix(name, 0) : name;
  for (int n = 1; !taken_.insert(unique).second; ++n) unique = GridDescriptor::addSuffix(name, n);
  return unique;
}

}  // namespace esvr::vdb
