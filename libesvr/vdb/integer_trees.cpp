#include "vdb/integer_trees.h"

template class openvdb::tree::Tree<openvdb::Int32Tree::RootNodeType>;
template class openvdb::tree::Tree<openvdb::Int64Tree::RootNodeType>;
template class openvdb::tree::Tree<openvdb::BoolTree::RootNodeType>;
template class openvdb::Grid<openvdb::Int32Tree>;
template class openvdb::Grid<openvdb::Int64Tree>;
template class openvdb::Grid<openvdb::BoolTree>;
