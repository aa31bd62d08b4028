#pragma once
/// OpenVDB's grids of integers and of masks, compiled once in integer_trees.cpp (scalar_trees.h says
/// why).

#include "vdb/versions.h"

#include <openvdb/openvdb.h>

extern template class openvdb::tree::Tree<openvdb::Int32Tree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Int64Tree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::BoolTree::RootNodeType>;
extern template class openvdb::Grid<openvdb::Int32Tree>;
extern template class openvdb::Grid<openvdb::Int64Tree>;
extern template class openvdb::Grid<openvdb::BoolTree>;
