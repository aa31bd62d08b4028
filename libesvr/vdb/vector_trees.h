#pragma once
/// OpenVDB's grids of vectors, compiled once in vector_trees.cpp (scalar_trees.h says why).

#include "vdb/versions.h"

#include <openvdb/openvdb.h>

extern template class openvdb::tree::Tree<openvdb::Vec3STree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Vec3DTree::RootNodeType>;
extern template class openvdb::Grid<openvdb::Vec3STree>;
extern template class openvdb::Grid<openvdb::Vec3DTree>;
