#include "vdb/trees.h"

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
