#pragma once
/// The directory of a .vdb file: the header, the file metadata and the position of each grid.
/// OpenVDB reads the voxels from this stream (tree_reader.h). The directory is read here, because
/// OpenVDB does not check sizes, cannot skip a grid of unknown type and does not keep the order of
/// grids.

#include <string>
#include <unordered_map>
#include <vector>

#include "esvr/carried_grid.h"
#include "esvr/grid_descriptor.h"
#include "vdb/input_file.h"

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

class Archive {
 public:
  /// \throws BadInput  the file is not a .vdb, is too old, or is damaged
  explicit Archive(InputFile& file);
  /// The archive of one grid that is carried.
  /// \param file  the grid's bytes
  Archive(InputFile& file, const CarriedGrid& grid);

  InputFile& file() { return file_; }
  [[nodiscard]] std::uint32_t vdbVersion() const { return vdbVersion_; }
  [[nodiscard]] const std::vector<MetaItem>& metadata() const { return metadata_; }
  [[nodiscard]] const std::vector<ArchiveEntry>& entries() const { return entries_; }
  GridHead readHead(const ArchiveEntry& entry);
  /// The entry that holds an entry's tree, which is the entry itself unless it has a parent.
  /// \throws BadInput  there is no such entry
  [[nodiscard]] const ArchiveEntry& treeOwner(const ArchiveEntry& entry) const;

 private:
  void readHeader();
  void readDirectory();

  InputFile& file_;
  std::uint32_t vdbVersion_ = 0;
  std::vector<MetaItem> metadata_;
  std::vector<ArchiveEntry> entries_;
  std::unordered_map<std::string, std::size_t>
      trees_;  ///< entries with trees by their stored names
};

/// True if the file begins as a .vdb file does.
bool beginsAsVdb(InputFile& file);

}  // namespace esvr::vdb
