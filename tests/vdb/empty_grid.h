#pragma once
/// Makes grids of types that are not fitted, from OpenVDB's registry. Their templates take minutes
/// to compile, so they stay in OpenVDB's library.

#include <openvdb/Grid.h>

#include <string>

namespace esvr::test {

/// A grid of a registered type without a voxel, as in emptyGrid("Tree_vec3s_5_4_3", "v").
openvdb::GridBase::Ptr emptyGrid(const std::string& treeType, const std::string& name);

}  // namespace esvr::test
