#pragma once
/// OpenVDB's grids of floats and doubles. A source that makes one would compile every virtual
/// function of their trees; scalar_trees.cpp does it once for all.

#include "vdb/versions.h"

#include <openvdb/openvdb.h>

extern template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::DoubleTree::RootNodeType>;
extern template class openvdb::Grid<openvdb::FloatTree>;
extern template class openvdb::Grid<openvdb::DoubleTree>;
