#include "vdb/open_vdb.h"

#include <nanovdb/NanoVDB.h>

#include <string>

#include "esvr/vdb_io.h"

template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
template class openvdb::tree::Tree<openvdb::DoubleTree::RootNodeType>;
template class openvdb::tree::Tree<openvdb::Vec3STree::RootNodeType>;
template class openvdb::tree::Tree<openvdb::Vec3DTree::RootNodeType>;
template class openvdb::tree::Tree<openvdb::Int32Tree::RootNodeType>;
template class openvdb::tree::Tree<openvdb::Int64Tree::RootNodeType>;
template class openvdb::tree::Tree<openvdb::BoolTree::RootNodeType>;
template class openvdb::Grid<openvdb::FloatTree>;
template class openvdb::Grid<openvdb::DoubleTree>;
template class openvdb::Grid<openvdb::Vec3STree>;
template class openvdb::Grid<openvdb::Vec3DTree>;
template class openvdb::Grid<openvdb::Int32Tree>;
template class openvdb::Grid<openvdb::Int64Tree>;
template class openvdb::Grid<openvdb::BoolTree>;

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
