#include "vdb/archive.h"

#include "vdb/open_vdb.h"

#include <openvdb/io/Compression.h>
#include <openvdb/io/io.h>

#include <numeric>
#include <utility>

#include "esvr/error.h"
#include "esvr/vdb_io.h"
#include "vdb/properties.h"
#include "vdb/tree_walk.h"

namespace esvr::vdb {
namespace {

constexpr char kNameSeparator = '\x1e';

/// Reads the entry of a directory up to its positions.
ArchiveEntry readNames(InputFile& file) {
  constexpr std::string_view kHalfSuffix = "_HalfFloat";
  ArchiveEntry entry;
  entry.storedName = file.readString();
  entry.treeType = file.readString();
  entry.savedAsHalf = entry.treeType.ends_with(kHalfSuffix);
  if (entry.savedAsHalf) entry.treeType.resize(entry.treeType.size() - kHalfSuffix.size());
  entry.parent = file.readString();
  return entry;
}

}  // namespace

std::string ArchiveEntry::name() const {
  return storedName.substr(0, storedName.find(kNameSeparator));
}

std::string ArchiveEntry::valueType() const {
  constexpr std::string_view kTreePrefix = "Tree_";
  if (!treeType.starts_with(kTreePrefix)) return shownName(treeType);
  const auto begin = kTreePrefix.size();
  return shownName(treeType.substr(begin, treeType.find('_', begin) - begin));
}

bool beginsAsVdb(InputFile& file) {
  if (file.size() < sizeof(std::int64_t)) return false;
  file.seek(0);
  return file.read<std::int64_t>() == std::int64_t(openvdb::OPENVDB_MAGIC);
}

namespace {

void addEntry(ArchiveEntry entry, ArchiveDirectory& directory) {
  if (entry.parent.empty()) directory.owners.emplace(entry.storedName, directory.entries.size());
  directory.entries.push_back(std::move(entry));
}

}  // namespace

Archive::Archive(InputFile& file, std::shared_ptr<const ArchiveDirectory> known)
    : file_(file), directory_(std::move(known)) {
  initializeOpenVdb();
  if (!directory_) directory_ = std::make_shared<const ArchiveDirectory>(readDirectory());
  setVersion();
}

/// Tells OpenVDB's functions how the file is written.
void Archive::setVersion() {
  const ArchiveDirectory& d = *directory_;
  openvdb::io::setVersion(file_.stream(), {d.libraryMajor, d.libraryMinor}, d.vdbVersion);
}

ArchiveDirectory Archive::readDirectory() {
  if (!beginsAsVdb(file_)) throw BadInput("is not a VDB file");
  ArchiveDirectory directory;
  directory.vdbVersion = file_.read<std::uint32_t>();
  if (directory.vdbVersion < kOldestFileVersion)
    throw BadInput("has VDB format version " + std::to_string(directory.vdbVersion) +
                   ", older than " + std::to_string(kOldestFileVersion) +
                   ": save it anew with a current program");
  directory.libraryMajor = file_.read<std::uint32_t>();
  directory.libraryMinor = file_.read<std::uint32_t>();
  openvdb::io::setVersion(file_.stream(), {directory.libraryMajor, directory.libraryMinor},
                          directory.vdbVersion);
  const bool hasPositions = file_.read<char>() != 0;
  constexpr std::uint64_t kUuidBytes = 36;
  file_.skip(kUuidBytes);

  directory.metadata = readMetadata(file_);
  const auto count = file_.read<std::int32_t>();
  if (count < 0) throw BadInput("is damaged: a negative number of grids");
  if (!hasPositions) {
    readStreamedGrids(count, directory);
    return directory;
  }
  for (std::int32_t i = 0; i < count; ++i) {
    ArchiveEntry entry = readNames(file_);
    const auto gridAt = file_.read<std::int64_t>();
    const auto blocksAt = file_.read<std::int64_t>();
    const auto next = file_.read<std::int64_t>();
    if (gridAt < std::int64_t(file_.position()) || next < gridAt)
      throw BadInput("is damaged: grid \"" + shownName(entry.name()) +
                     "\" has no valid place in the file");
    entry.gridAt = std::uint64_t(gridAt);
    entry.gridBytes = std::uint64_t(next - gridAt);
    entry.blocksAt = std::uint64_t(blocksAt);
    file_.seek(std::uint64_t(next));
    addEntry(std::move(entry), directory);
  }
  return directory;
}

Archive::Archive(InputFile& file, const CarriedGrid& grid) : file_(file) {
  initializeOpenVdb();
  ArchiveDirectory directory;
  directory.libraryMajor = openvdb::OPENVDB_LIBRARY_MAJOR_VERSION;
  directory.libraryMinor = openvdb::OPENVDB_LIBRARY_MINOR_VERSION;
  directory.vdbVersion = grid.vdbVersion;
  ArchiveEntry& entry = directory.entries.emplace_back();
  entry.storedName = grid.name;
  entry.treeType = grid.treeType;
  entry.savedAsHalf = grid.savedAsHalf;
  entry.gridBytes = file.size();
  entry.blocksAt = grid.blocksAt;
  directory_ = std::make_shared<const ArchiveDirectory>(std::move(directory));
  setVersion();
}

void Archive::readStreamedGrids(std::int32_t count, ArchiveDirectory& directory) {
  constexpr std::uint64_t kPositions = 3 * sizeof(std::int64_t);  // which are 0
  for (std::int32_t i = 0; i < count; ++i) {
    ArchiveEntry entry = readNames(file_);
    file_.skip(kPositions);
    entry.gridAt = file_.position();
    entry.gridBytes = file_.remaining();
    inGrid(entry.name(), [&] { locate(entry, i + 1 == count); });
    file_.seek(entry.gridAt + entry.gridBytes);
    addEntry(std::move(entry), directory);
  }
}

/// Finds the values and the end of a grid of a stream.
void Archive::locate(ArchiveEntry& entry, bool isLast) {
  const GridHead head = readHead(entry);
  entry.blocksAt = head.treeAt;
  if (!entry.parent.empty()) {
    entry.gridBytes = head.treeAt - entry.gridAt;
    return;
  }
  const auto layout = layoutOf({entry.treeType, entry.savedAsHalf, head.compression});
  if (!layout && isLast) return;
  const auto extent = layout ? extentOfTree(file_, *layout) : TreeExtent{};
  if (extent.valuesAt != 0) entry.blocksAt = extent.valuesAt;
  if (extent.end != 0)
    entry.gridBytes = extent.end - entry.gridAt;
  else if (!isLast)
    throw BadInput("the file was written to a stream, and the end of a tree of type " +
                   entry.treeType +
                   " cannot be found in it: save it to a file, or with this grid as the last one");
}

GridHead Archive::readHead(const ArchiveEntry& entry) {
  const InputFile::Within grid(file_, entry.gridAt + entry.gridBytes);
  file_.seek(entry.gridAt);
  GridHead head;
  head.compression = file_.read<std::uint32_t>();
  head.metadata = vdb::readMetadata(file_);
  head.transform = readTransform(file_);
  head.treeAt = file_.position();
  return head;
}

const ArchiveEntry& Archive::treeOwner(const ArchiveEntry& entry) const {
  if (entry.parent.empty()) return entry;
  const auto parent = directory_->owners.find(entry.parent);
  if (parent == directory_->owners.end())
    throw BadInput("shares the voxels of a grid that is not there");
  return entries()[parent->second];
}

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

CarriedGrid carry(Archive& archive, std::size_t place, const VoxelMemory& memory) {
  const ArchiveEntry& entry = archive.entries().at(place);
  const ArchiveEntry& owner = archive.treeOwner(entry);
  if (const auto why = whyNotCarried(entry.treeType, archive.vdbVersion()); !why.empty())
    throw BadInput(why);
  if (owner.treeType != entry.treeType)
    throw BadInput("is damaged: it shares the voxels of a grid of another type");
  const GridHead head = archive.readHead(entry);
  CarriedGrid grid{.name = stringValue(head.metadata, openvdb::GridBase::META_GRID_NAME),
                   .treeType = owner.treeType,
                   .savedAsHalf = owner.savedAsHalf,
                   .vdbVersion = archive.vdbVersion(),
                   .place = std::uint32_t(place),
                   .bytes = {}};

  struct Range {
    std::uint64_t at = 0, bytes = 0;
  };
  std::vector<Range> ranges;
  if (entry.parent.empty()) {
    ranges = {{entry.gridAt, entry.gridBytes}};
    grid.blocksAt = entry.blocksAt - entry.gridAt;
  } else {
    // The flags are those with which the shared tree is compressed. They come before all else.
    constexpr std::uint64_t kFlagBytes = sizeof(std::uint32_t);
    const auto rangeTo = [](std::uint64_t begin, std::uint64_t end) {
      if (end < begin) throw BadInput("is damaged: the grid is shorter than its metadata");
      return Range{begin, end - begin};
    };
    const std::uint64_t treeAt = archive.readHead(owner).treeAt;
    grid.blocksAt = head.treeAt - entry.gridAt + owner.blocksAt - treeAt;
    ranges = {{owner.gridAt, kFlagBytes},
              rangeTo(entry.gridAt + kFlagBytes, head.treeAt),
              rangeTo(treeAt, owner.gridAt + owner.gridBytes)};
  }

  InputFile& file = archive.file();
  const auto total =
      std::accumulate(ranges.begin(), ranges.end(), std::uint64_t{0},
                      [](std::uint64_t sum, const Range& range) { return sum + range.bytes; });
  if (total > file.size()) throw BadInput("is damaged: a grid is larger than the file");
  grid.bytes = VoxelArray<std::byte>(total, memory);
  std::uint64_t done = 0;
  for (const Range& range : ranges) {
    file.seek(range.at);
    file.read(grid.bytes.data() + done, range.bytes);
    done += range.bytes;
  }
  return grid;
}

}  // namespace esvr::vdb
