#include "vdb/open_vdb.h"

#include <nanovdb/NanoVDB.h>

#include <memory>
#include <string>
#include <vector>

#include "esvr/vdb_io.h"

// libopenvdb has the virtual functions of these trees and grids, which are most of their code. Where it exports them
// (cmake/openvdb_exports_trees.cpp), the only functions that are missing are the others that this library and its tests
// use. Code without optimisation calls each of them, so that the linker of tests names those that this list lacks.
#ifdef ESVR_OPENVDB_EXPORTS_TREES
#define ESVR_TREE(Name)                                                                        \
  template Name##Tree::Tree(const Name##Tree::ValueType&);                                     \
  template std::unique_ptr<const std::string> Name##Tree::sTreeTypeName;                       \
  template void Name##Tree::getNodeLog2Dims(std::vector<Index>&);                              \
  template const Name##Tree::ValueType& Name##Tree::background() const;                        \
  template Name##Tree::RootNodeType& Name##Tree::root();                                       \
  template const Name##Tree::RootNodeType& Name##Tree::root() const;                           \
  template const std::string& Name##Tree::treeType();                                          \
  template const Name##Tree::ValueType& Name##Tree::getValue(const Coord&) const;              \
  template void Name##Tree::setValue(const Coord&, const Name##Tree::ValueType&);              \
  template void Name##Tree::setValueOn(const Coord&, const Name##Tree::ValueType&);            \
  template void Name##Tree::setValueOff(const Coord&, const Name##Tree::ValueType&);           \
  template void Name##Tree::addTile(Index, const Coord&, const Name##Tree::ValueType&, bool);  \
  template Name##Tree::LeafNodeType* Name##Tree::touchLeaf(const Coord&);                      \
  template Name##Tree::LeafCIter Name##Tree::cbeginLeaf() const;                               \
  template Name##Tree::ValueOnCIter Name##Tree::cbeginValueOn() const;                         \
  template Name##Tree::ValueOffCIter Name##Tree::cbeginValueOff() const;                       \
  template Name##Tree::ValueAllCIter Name##Tree::cbeginValueAll() const;                       \
  template Name##Tree::ValueOffIter Name##Tree::beginValueOff();                               \
  template void Name##Tree::attachAccessor(tree::ValueAccessorBase<Name##Tree, true>&) const;  \
  template void Name##Tree::attachAccessor(tree::ValueAccessorBase<const Name##Tree, true>&)   \
      const;                                                                                   \
  template void Name##Tree::releaseAccessor(tree::ValueAccessorBase<Name##Tree, true>&) const; \
  template void Name##Tree::releaseAccessor(tree::ValueAccessorBase<const Name##Tree, true>&)  \
      const;                                                                                   \
  template Name##Grid::Grid(const Name##Tree::ValueType&);                                     \
  template Name##Grid::Grid(Name##Tree::Ptr);                                                  \
  template Name##Grid::Ptr Name##Grid::create();                                               \
  template Name##Grid::Ptr Name##Grid::create(const Name##Tree::ValueType&);                   \
  template Name##Grid::Ptr Name##Grid::create(Name##Tree::Ptr);                                \
  template std::string Name##Grid::gridType();                                                 \
  template Name##Tree& Name##Grid::tree();                                                     \
  template const Name##Tree& Name##Grid::tree() const;                                         \
  template Name##Tree::Ptr Name##Grid::treePtr();                                              \
  template const Name##Tree::ValueType& Name##Grid::background() const;                        \
  template Name##Grid::Accessor Name##Grid::getAccessor();                                     \
  template Name##Grid::ConstAccessor Name##Grid::getConstAccessor() const;                     \
  template Name##Grid::ValueOnCIter Name##Grid::cbeginValueOn() const;                         \
  template Name##Grid::ValueOffCIter Name##Grid::cbeginValueOff() const;                       \
  template Name##Grid::ValueAllCIter Name##Grid::cbeginValueAll() const;                       \
  template Name##Grid::ValueOffIter Name##Grid::beginValueOff();
#else
#define ESVR_TREE(Name)                                \
  template class tree::Tree<Name##Tree::RootNodeType>; \
  template class Grid<Name##Tree>;
#endif

namespace openvdb {
ESVR_TREE(Float)
ESVR_TREE(Double)
ESVR_TREE(Vec3S)
ESVR_TREE(Vec3D)
ESVR_TREE(Int32)
ESVR_TREE(Int64)
ESVR_TREE(Bool)
}  // namespace openvdb

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
