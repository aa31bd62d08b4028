#pragma once
/// Grids of types that are not fitted, from OpenVDB's registry: their templates, which take minutes
/// to compile, stay in its library.

#include <openvdb/Grid.h>

#include <string>

namespace esvr::test {

/// A grid of a registered type, as in emptyGrid("Tree_vec3s_5_4_3", "v"), without a voxel.
openvdb::GridBase::Ptr emptyGrid(const std::string& treeType, const std::string& name);

}  // namespace esvr::test
