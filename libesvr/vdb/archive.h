#pragma once
/// A .vdb file's directory: header, file metadata and where each grid lies. Voxels are read by
/// OpenVDB from this stream (tree_reader.h); what leads to them is read here, since OpenVDB's own
/// directory believes every size, cannot pass over a grid of unknown type and forgets the order.

#include <string>
#include <vector>

#include "esvr/grid_descriptor.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

/// One grid's row of the directory.
struct ArchiveEntry {
  std::string storedName;  ///< OpenVDB's unique name: the name, "\x1e" and a number
  std::string treeType;    ///< "Tree_float_5_4_3"
  bool savedAsHalf = false;
  std::string parent;  ///< storedName of the grid whose tree this one shares; else empty
  std::uint64_t gridAt = 0;
  std::uint64_t gridBytes = 0;

  [[nodiscard]] std::string name() const;       ///< without the number
  [[nodiscard]] std::string valueType() const;  ///< "float", "vec3s", "ptdataidx32", ...
};

/// The part of a grid before its tree.
struct GridHead {
  std::vector<MetaItem> metadata;  ///< file statistics included
  Transform transform;
  std::uint32_t compression = 0;  ///< OpenVDB's flags
  std::uint64_t treeAt = 0;       ///< begin of the tree; a grid with a parent has none
};

class Archive {
 public:
  /// \throws BadInput  not a .vdb, too old, damaged
  explicit Archive(InputFile& file);

  InputFile& file() { return file_; }
  [[nodiscard]] const std::vector<MetaItem>& metadata() const { return metadata_; }
  [[nodiscard]] const std::vector<ArchiveEntry>& entries() const { return entries_; }
  GridHead readHead(const ArchiveEntry& entry);
  /// The entry that holds this one's tree: itself unless it has a parent. \throws BadInput  none
  [[nodiscard]] const ArchiveEntry& treeOwner(const ArchiveEntry& entry) const;

 private:
  void readHeader();
  void readDirectory();

  InputFile& file_;
  std::vector<MetaItem> metadata_;
  std::vector<ArchiveEntry> entries_;
};

/// True where the file begins as a .vdb does.
bool beginsAsVdb(InputFile& file);

}  // namespace esvr::vdb
