#pragma once
/// The directory of a .vdb file (the header, the file metadata and the position of each grid), and its
/// grids as bytes. OpenVDB reads the voxels from the stream of the file (read_vdb.cpp). The directory
/// is read here, because OpenVDB does not check sizes, cannot skip a grid of unknown type and does not
/// keep the order of grids.
///
/// A file that was written to a stream, for example to a pipe, has no positions of grids. They are
/// found by a walk over all trees (tree_walk.h), which reads no voxels. The end of a grid with a
/// tree that cannot be walked over is known only if it is the last one, which ends with the file.

#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/read_input.h"
#include "esvr/grid.h"
#include "vdb/files.h"

namespace esvr::vdb {

/// The directory's entry for one grid.
struct ArchiveEntry {
  std::string storedName;  ///< OpenVDB's unique name: the name, "\x1e" and a number
  std::string treeType;    ///< "Tree_float_5_4_3"
  bool savedAsHalf = false;
  std::string parent;  ///< storedName of the grid whose tree this grid shares; else empty
  std::uint64_t gridAt = 0;
  std::uint64_t gridBytes = 0;
  std::uint64_t blocksAt = 0;  ///< position of the values, as the file says; it is not checked

  [[nodiscard]] std::string name() const;  ///< the name without the number
  /// "float", "vec3s", "ptdataidx32", ...; a text that can be shown (shownName)
  [[nodiscard]] std::string valueType() const;
};

/// The part of a grid before its tree.
struct GridHead {
  std::vector<MetaItem> metadata;  ///< including the file's statistics
  Transform transform;
  std::uint32_t compression = 0;  ///< OpenVDB's flags
  std::uint64_t treeAt = 0;       ///< position of the tree; a grid with a parent has none
};

/// What the directory of a file says. It takes a look at every grid to read it, so that it is kept for
/// those who read many grids of a file.
struct ArchiveDirectory {
  std::optional<FileStamp> stamp{};  ///< of the file; none: the bytes of a carried grid
  std::uint32_t libraryMajor = 0, libraryMinor = 0;  ///< version of the library that has written it
  std::uint32_t vdbVersion = 0;
  std::vector<MetaItem> metadata{};
  std::vector<ArchiveEntry> entries{};
  /// Entries with a tree of their own, by their stored names.
  std::unordered_map<std::string, std::size_t> owners{};
};

class Archive {
 public:
  /// \param known  the directory of this very file; null: it is read
  /// \throws BadInput  the file is not a .vdb, is too old, or is damaged; it was written to a stream
  ///                   and has a tree before its last grid that cannot be walked over
  explicit Archive(InputFile& file, std::shared_ptr<const ArchiveDirectory> known = nullptr);
  /// The archive of one grid that is carried.
  /// \param file  the grid's bytes
  Archive(InputFile& file, const CarriedGrid& grid);

  InputFile& file() { return file_; }
  [[nodiscard]] const std::shared_ptr<const ArchiveDirectory>& directory() const {
    return directory_;
  }
  [[nodiscard]] std::uint32_t vdbVersion() const { return directory_->vdbVersion; }
  [[nodiscard]] const std::vector<MetaItem>& metadata() const { return directory_->metadata; }
  [[nodiscard]] const std::vector<ArchiveEntry>& entries() const { return directory_->entries; }
  /// \throws BadInput  the head is damaged or ends behind its grid
  GridHead readHead(const ArchiveEntry& entry);
  /// The entry that holds an entry's tree, which is the entry itself unless it has a parent.
  /// \throws BadInput  there is no such entry
  [[nodiscard]] const ArchiveEntry& treeOwner(const ArchiveEntry& entry) const;

 private:
  [[nodiscard]] ArchiveDirectory readDirectory();
  void readStreamedGrids(std::int32_t count, ArchiveDirectory& directory);
  void locate(ArchiveEntry& entry, bool isLast);
  void setVersion();

  InputFile& file_;
  std::shared_ptr<const ArchiveDirectory> directory_;
};

/// True if the file begins as a .vdb file does.
bool beginsAsVdb(InputFile& file);

/// True if OpenVDB's name of a tree is that of points.
bool isPointTree(const std::string& treeType);

/// The reason, for the user, why a grid of a file of this version cannot be carried; else empty.
std::string whyNotCarried(const std::string& treeType, std::uint32_t vdbVersion);

/// A grid of an archive with the bytes that a file needs of it. A grid without a tree of its own gets
/// the one that it shares.
/// \throws BadInput  the grid cannot be carried, or is damaged
CarriedGrid carry(Archive& archive, std::size_t place, const VoxelMemory& memory);

}  // namespace esvr::vdb
