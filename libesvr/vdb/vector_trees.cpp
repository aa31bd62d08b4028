#include "vdb/vector_trees.h"

template class openvdb::tree::Tree<openvdb::Vec3STree::RootNodeType>;
template class openvdb::tree::Tree<openvdb::Vec3DTree::RootNodeType>;
template class openvdb::Grid<openvdb::Vec3STree>;
template class openvdb::Grid<openvdb::Vec3DTree>;
