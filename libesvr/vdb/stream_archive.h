#pragma once
/// OpenVDB's archives on a stream of this library.

#include "vdb/versions.h"

#include <openvdb/io/Archive.h>

#include <cstdint>
#include <ostream>

namespace esvr::vdb {

/// OpenVDB's own class File ignores the errors of the stream that it writes to. This class writes
/// to a stream that throws.
class StreamArchive : public openvdb::io::Archive {
 public:
  /// \param compression  OpenVDB's flags
  explicit StreamArchive(std::uint32_t compression) { setCompression(compression); }

  void writeTo(std::ostream& stream, const openvdb::GridPtrVec& grids,
               const openvdb::MetaMap& metadata) const {
    constexpr bool kSeekable = true;
    Archive::write(stream, grids, kSeekable, metadata);
  }
};

}  // namespace esvr::vdb
