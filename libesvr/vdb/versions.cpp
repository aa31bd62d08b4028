#include "vdb/versions.h"

#include <nanovdb/NanoVDB.h>
#include <openvdb/openvdb.h>

#include <string>

#include "esvr/vdb_io.h"

namespace esvr::vdb {

void initializeOpenVdb() { openvdb::initialize(); }

}  // namespace esvr::vdb

namespace esvr {

std::string vdbVersions() {
  const auto dotted = [](int major, int minor, int patch) {
    return std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(patch);
  };
  return "OpenVDB " OPENVDB_LIBRARY_VERSION_STRING ", NanoVDB " +
         dotted(NANOVDB_MAJOR_VERSION_NUMBER, NANOVDB_MINOR_VERSION_NUMBER,
                NANOVDB_PATCH_VERSION_NUMBER);
}

}  // namespace esvr
