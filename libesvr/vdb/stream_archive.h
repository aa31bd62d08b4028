#pragma once
/// OpenVDB's archives on a stream of ours.

#include "vdb/versions.h"

#include <openvdb/io/Archive.h>

#include <cstdint>
#include <ostream>

namespace esvr::vdb {

/// OpenVDB's own File writes to a stream whose errors nobody looks at; this one takes ours, which
/// throws.
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
