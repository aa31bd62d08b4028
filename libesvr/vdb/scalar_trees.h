#pragma once
/// OpenVDB's grids of floats and doubles. Every source file that uses them would compile all
/// virtual functions of their trees; scalar_trees.cpp compiles them once.

#include "vdb/versions.h"

#include <openvdb/openvdb.h>

extern template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::DoubleTree::RootNodeType>;
extern template class openvdb::Grid<openvdb::FloatTree>;
extern template class openvdb::Grid<openvdb::DoubleTree>;
