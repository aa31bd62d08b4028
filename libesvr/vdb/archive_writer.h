#pragma once
/// Writes a .vdb file grid by grid, so that grids of OpenVDB and grids that are only bytes may
/// follow each other in any order.

#include "vdb/versions.h"

#include <openvdb/io/Archive.h>

#include <ostream>
#include <span>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "esvr/carried_grid.h"

namespace esvr::vdb {

/// OpenVDB's own functions write the header and the parts of a grid. They write to a stream that
/// throws, unlike OpenVDB's class File.
///
/// Archive::writeGrid() is not used: it compresses all voxels a first time, to store the bytes of
/// each leaf in the metadata item `file_delayed_load`. A StreamedGrid holds no voxels then, so that
/// the item would be wrong, and applications that load voxels when they need them, such as Blender,
/// would crash. Without the item, they find the bytes of each leaf in front of its voxels.
class ArchiveWriter : private openvdb::io::Archive {
 public:
  /// Writes the header.
  /// \param stream       must be seekable and outlive this object
  /// \param compression  OpenVDB's flags
  /// \param names        names of all grids that are added later, in their order
  ArchiveWriter(std::ostream& stream, std::uint32_t compression, const openvdb::MetaMap& metadata,
                std::vector<std::string> names);

  void add(const openvdb::GridBase::ConstPtr& grid);
  /// \throws RuntimeFailure  the bytes are of a version of the format that OpenVDB does not write
  void add(const CarriedGrid& grid);

 private:
  /// The name of the next grid in the directory, which no grid before it has.
  std::string nextName();

  std::ostream& stream_;
  openvdb::io::StreamMetadata::Ptr state_;  ///< the stream points to this member
  std::vector<std::string> names_;
  std::unordered_map<std::string, int> counts_;   ///< of grids by their names
  std::unordered_map<std::string, int> numbers_;  ///< the next numbers of grids that share a name
  std::unordered_set<std::string> taken_;         ///< names of the directory so far
  std::size_t next_ = 0;
};

}  // namespace esvr::vdb
