#include "vdb/archive.h"

#include <openvdb/io/Compression.h>
#include <openvdb/io/io.h>

#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "vdb/errors.h"
#include "vdb/metadata.h"
#include "vdb/transform.h"
#include "vdb/tree_survey.h"
#include "vdb/versions.h"

namespace esvr::vdb {
namespace {

constexpr char kNameSeparator = '\x1e';
constexpr const char* kHalfSuffix = "_HalfFloat";
constexpr const char* kTreePrefix = "Tree_";
constexpr std::uint64_t kUuidBytes = 36;

std::string withoutSuffix(const std::string& text, const std::string& suffix) {
  return text.ends_with(suffix) ? text.substr(0, text.size() - suffix.size()) : text;
}

/// An entry and the position of the next one.
struct DirectoryRow {
  ArchiveEntry entry;
  std::int64_t next = 0;
};

/// Reads the entry up to its positions.
ArchiveEntry readNames(InputFile& file) {
  ArchiveEntry entry;
  entry.storedName = file.readString();
  const std::string type = file.readString();
  entry.treeType = withoutSuffix(type, kHalfSuffix);
  entry.savedAsHalf = entry.treeType != type;
  entry.parent = file.readString();
  return entry;
}

DirectoryRow readRow(InputFile& file) {
  DirectoryRow row{readNames(file)};
  const auto gridAt = file.read<std::int64_t>();
  const auto blocksAt = file.read<std::int64_t>();
  row.next = file.read<std::int64_t>();
  if (gridAt < std::int64_t(file.position()) || row.next < gridAt)
    throw BadInput("is damaged: grid \"" + shownName(row.entry.name()) +
                   "\" has no valid place in the file");
  row.entry.gridAt = std::uint64_t(gridAt);
  row.entry.gridBytes = std::uint64_t(row.next - gridAt);
  row.entry.blocksAt = std::uint64_t(blocksAt);
  return row;
}

}  // namespace

std::string ArchiveEntry::name() const {
  return storedName.substr(0, storedName.find(kNameSeparator));
}

std::string ArchiveEntry::valueType() const {
  if (!treeType.starts_with(kTreePrefix)) return shownName(treeType);
  const auto begin = std::string(kTreePrefix).size();
  return shownName(treeType.substr(begin, treeType.find('_', begin) - begin));
}

bool beginsAsVdb(InputFile& file) {
  if (file.size() < sizeof(std::int64_t)) return false;
  file.seek(0);
  return file.read<std::int64_t>() == std::int64_t(openvdb::OPENVDB_MAGIC);
}

Archive::Archive(InputFile& file) : file_(file) {
  initializeOpenVdb();
  if (!beginsAsVdb(file_)) throw BadInput("is not a VDB file");
  readHeader();
  metadata_ = readMetadata(file_);
  readDirectory();
}

Archive::Archive(InputFile& file, const CarriedGrid& grid)
    : file_(file), vdbVersion_(grid.vdbVersion) {
  initializeOpenVdb();
  const openvdb::VersionId library{openvdb::OPENVDB_LIBRARY_MAJOR_VERSION,
                                   openvdb::OPENVDB_LIBRARY_MINOR_VERSION};
  openvdb::io::setVersion(file_.stream(), library, vdbVersion_);
  ArchiveEntry& entry = entries_.emplace_back();
  entry.storedName = grid.name;
  entry.treeType = grid.treeType;
  entry.savedAsHalf = grid.savedAsHalf;
  entry.gridBytes = file.size();
  entry.blocksAt = grid.blocksAt;
}

void Archive::readHeader() {
  vdbVersion_ = file_.read<std::uint32_t>();
  if (vdbVersion_ < kOldestFileVersion)
    throw BadInput("has VDB format version " + std::to_string(vdbVersion_) + ", older than " +
                   std::to_string(kOldestFileVersion) + ": save it anew with a current program");
  const auto major = file_.read<std::uint32_t>();
  const auto minor = file_.read<std::uint32_t>();
  openvdb::io::setVersion(file_.stream(), {major, minor}, vdbVersion_);
  hasPositions_ = file_.read<char>() != 0;
  file_.skip(kUuidBytes);
}

void Archive::readDirectory() {
  const auto count = file_.read<std::int32_t>();
  if (count < 0) throw BadInput("is damaged: a negative number of grids");
  if (!hasPositions_) return readStreamedGrids(count);
  for (std::int32_t i = 0; i < count; ++i) {
    DirectoryRow row = readRow(file_);
    file_.seek(std::uint64_t(row.next));
    addEntry(std::move(row.entry));
  }
}

void Archive::addEntry(ArchiveEntry entry) {
  if (entry.parent.empty()) owners_.emplace(entry.storedName, entries_.size());
  entries_.push_back(std::move(entry));
}

void Archive::readStreamedGrids(std::int32_t count) {
  constexpr std::uint64_t kPositions = 3 * sizeof(std::int64_t);  // which are 0
  for (std::int32_t i = 0; i < count; ++i) {
    ArchiveEntry entry = readNames(file_);
    file_.skip(kPositions);
    entry.gridAt = file_.position();
    entry.gridBytes = file_.remaining();
    inGrid(entry.name(), [&] { locate(entry, i + 1 == count); });
    file_.seek(entry.gridAt + entry.gridBytes);
    addEntry(std::move(entry));
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
  const auto parent = owners_.find(entry.parent);
  if (parent == owners_.end()) throw BadInput("shares the voxels of a grid that is not there");
  return entries_[parent->second];
}

}  // namespace esvr::vdb
