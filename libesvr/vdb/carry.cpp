#include "vdb/carry.h"

#include "vdb/versions.h"

#include <openvdb/Grid.h>

#include <numeric>

#include "core/memory_budget.h"
#include "esvr/error.h"
#include "vdb/archive.h"
#include "vdb/errors.h"

namespace esvr::vdb {
namespace {

constexpr std::uint64_t kFlagBytes = sizeof(std::uint32_t);  // the compression, before all else

struct FileRange {
  std::uint64_t at = 0, bytes = 0;
};

/// The range from `begin` to `end`. \throws BadInput  it ends before it begins
FileRange rangeTo(std::uint64_t begin, std::uint64_t end) {
  if (end < begin) throw BadInput("is damaged: the grid is shorter than its metadata");
  return {begin, end - begin};
}

std::uint64_t endOf(const ArchiveEntry& entry) { return entry.gridAt + entry.gridBytes; }

/// The parts of the file that are the grid. A grid without a tree of its own gets the one that it
/// shares, and the flags with which that tree is compressed.
std::vector<FileRange> rangesOf(Archive& archive, const ArchiveEntry& entry, const GridHead& head) {
  if (entry.parent.empty()) return {{entry.gridAt, entry.gridBytes}};
  const ArchiveEntry& owner = archive.treeOwner(entry);
  return {{owner.gridAt, kFlagBytes},
          rangeTo(entry.gridAt + kFlagBytes, head.treeAt),
          rangeTo(archive.readHead(owner).treeAt, endOf(owner))};
}

/// Position of the values in the bytes of the grid.
std::uint64_t blocksOf(Archive& archive, const ArchiveEntry& entry, const GridHead& head) {
  if (entry.parent.empty()) return entry.blocksAt - entry.gridAt;
  const ArchiveEntry& owner = archive.treeOwner(entry);
  return head.treeAt - entry.gridAt + owner.blocksAt - archive.readHead(owner).treeAt;
}

VoxelArray<std::byte> readRanges(InputFile& file, const std::vector<FileRange>& ranges,
                                 const VoxelMemory& memory) {
  const auto total =
      std::accumulate(ranges.begin(), ranges.end(), std::uint64_t{0},
                      [](std::uint64_t sum, const FileRange& r) { return sum + r.bytes; });
  if (total > file.size()) throw BadInput("is damaged: a grid is larger than the file");
  VoxelArray<std::byte> bytes(total, memory);
  std::uint64_t done = 0;
  for (const FileRange& range : ranges) {
    file.seek(range.at);
    file.read(bytes.data() + done, range.bytes);
    done += range.bytes;
  }
  return bytes;
}

CarriedGrid carry(Archive& archive, std::size_t place, const VoxelMemory& memory) {
  const ArchiveEntry& entry = archive.entries().at(place);
  const ArchiveEntry& owner = archive.treeOwner(entry);
  if (const auto why = whyNotCarried(entry.treeType, archive.vdbVersion()); !why.empty())
    throw BadInput(why);
  if (owner.treeType != entry.treeType)
    throw BadInput("is damaged: it shares the voxels of a grid of another type");
  const GridHead head = archive.readHead(entry);
  return {.name = stringValue(head.metadata, openvdb::GridBase::META_GRID_NAME),
          .treeType = owner.treeType,
          .savedAsHalf = owner.savedAsHalf,
          .vdbVersion = archive.vdbVersion(),
          .place = std::uint32_t(place),
          .blocksAt = blocksOf(archive, entry, head),
          .bytes = readRanges(archive.file(), rangesOf(archive, entry, head), memory)};
}

/// Bytes of the heap that a carried grid takes.
double heapBytes(const Archive& archive, std::size_t place, const VoxelMemory& memory) {
  const std::uint64_t bytes = archive.treeOwner(archive.entries()[place]).gridBytes;
  return memory.isInFile(bytes) ? 0.0 : double(bytes);
}

}  // namespace

bool isPointTree(const std::string& treeType) {
  return treeType.starts_with("Tree_ptdataidx") || treeType.starts_with("Tree_ptidx");
}

std::string whyNotCarried(const std::string& treeType, std::uint32_t vdbVersion) {
  const std::string version = "the version of its VDB format, " + std::to_string(vdbVersion) + ", ";
  if (vdbVersion < kOldestFileVersion || vdbVersion > kNewestFileVersion)
    return version + "is not between " + std::to_string(kOldestFileVersion) + " and " +
           std::to_string(kNewestFileVersion);
  // The bytes of all other trees are the same in the versions that can be read.
  if (isPointTree(treeType) && vdbVersion < openvdb::OPENVDB_FILE_VERSION_MULTIPASS_IO)
    return version +
           "stores points in another way than current files; save it anew with a current "
           "program";
  return {};
}

std::vector<CarriedGrid> readOpenVdbCarried(InputFile& file, std::span<const std::size_t> places,
                                            const ReadOptions& options) {
  Archive archive(file);
  MemoryBudget budget(options.maxBytes);
  std::vector<CarriedGrid> grids;
  for (const std::size_t place : places)
    inGrid(archive.entries().at(place).name(), [&] {
      budget.take(heapBytes(archive, place, options.memory), "carrying it unchanged");
      grids.push_back(carry(archive, place, options.memory));
    });
  return grids;
}

}  // namespace esvr::vdb
