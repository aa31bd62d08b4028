#include "vdb/archive_writer.h"

#include <openvdb/io/Compression.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>

#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "vdb/carry.h"

namespace esvr::vdb {
namespace {

constexpr bool kSeekable = true;

/// Writes the metadata of a grid with its statistics.
void writeMetadata(const openvdb::GridBase& grid, std::ostream& stream) {
  using openvdb::GridBase;
  const auto copy = openvdb::ConstPtrCast<GridBase>(grid.copyGrid());  // shares the tree
  copy->addStatsMetadata();
  // The copy does not know how many bytes the voxels of a StreamedGrid take.
  copy->insertMeta(GridBase::META_FILE_MEM_BYTES,
                   openvdb::Int64Metadata(openvdb::Int64(grid.memUsage())));
  const auto packing = openvdb::io::compressionToString(openvdb::io::getDataCompression(stream));
  copy->insertMeta(GridBase::META_FILE_COMPRESSION, openvdb::StringMetadata(packing));
  copy->writeMeta(stream);
}

}  // namespace

ArchiveWriter::ArchiveWriter(std::ostream& stream, std::uint32_t compression,
                             const openvdb::MetaMap& metadata, std::vector<std::string> names)
    : stream_(stream),
      state_(std::make_shared<openvdb::io::StreamMetadata>()),
      names_(std::move(names)) {
  setCompression(compression);
  openvdb::io::setStreamMetadataPtr(stream_, state_, /*transfer=*/false);
  openvdb::io::setDataCompression(stream_, compression);
  writeHeader(stream_, kSeekable);
  metadata.writeMeta(stream_);
  for (const std::string& name : names_) ++counts_[name];
  const auto count = std::int32_t(names_.size());
  stream_.write(reinterpret_cast<const char*>(&count), sizeof count);
}

void ArchiveWriter::add(const openvdb::GridBase::ConstPtr& grid) {
  openvdb::io::GridDescriptor row(nextName(), grid->type(), grid->saveFloatAsHalf());
  row.writeHeader(stream_);
  const auto positions = stream_.tellp();
  row.writeStreamPos(stream_);
  row.setGridPos(stream_.tellp());
  setGridCompression(stream_, *grid);
  writeMetadata(*grid, stream_);
  grid->writeTransform(stream_);
  grid->writeTopology(stream_);
  row.setBlockPos(stream_.tellp());
  grid->writeBuffers(stream_);
  row.setEndPos(stream_.tellp());
  stream_.seekp(positions);
  row.writeStreamPos(stream_);
  row.seekToEnd(stream_);
  // Some flags of the compression depend on the grid.
  openvdb::io::setDataCompression(stream_, compression());
}

void ArchiveWriter::add(const CarriedGrid& grid) {
  if (const auto why = whyNotCarried(grid.treeType, grid.vdbVersion); !why.empty())
    throw RuntimeFailure("grid \"" + shownName(grid.name) + "\" cannot be written: " + why);
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
  const bool isAlone = !name.empty() && counts_.at(name) == 1;
  if (isAlone && taken_.insert(name).second) return name;
  for (int& number = numbers_[name];;) {
    std::string unique = GridDescriptor::addSuffix(name, number++);
    // OpenVDB also finds this grid by "NAME[number]", which another grid may be called.
    if (counts_.contains(GridDescriptor::nameAsString(unique))) continue;
    if (taken_.insert(unique).second) return unique;
  }
}

}  // namespace esvr::vdb
