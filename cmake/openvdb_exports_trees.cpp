// A program that links only if libopenvdb exports the virtual functions of its trees and grids (libesvr/vdb/open_vdb.h).
// It declares the templates itself, because OpenVDB's headers would take longer to compile than the answer is worth.
#include <openvdb/version.h>

#include <cstdint>
#include <iostream>

namespace openvdb {
namespace OPENVDB_VERSION_NAME {

namespace math {
template <class T>
class Vec3;
}

namespace tree {

template <class Value, std::uint32_t kLog2>
class LeafNode;
template <class Child, std::uint32_t kLog2>
class InternalNode;
template <class Child>
class RootNode;

template <class Root>
struct Tree {
  using RootNodeType = Root;
  [[gnu::always_inline]] Tree() {}  // refers to the table of virtual functions
  virtual ~Tree();
  virtual void readTopology(std::istream&, bool);
};

template <class Value>
using Usual = Tree<RootNode<InternalNode<InternalNode<LeafNode<Value, 3>, 4>, 5>>>;

}  // namespace tree

template <class Tree>
struct Grid {
  [[gnu::always_inline]] Grid() {}
  virtual ~Grid();
  virtual void readTopology(std::istream&);
};

}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

#define ESVR_READ(Value)                                                                 \
  extern template struct openvdb::tree::Tree<openvdb::tree::Usual<Value>::RootNodeType>; \
  extern template struct openvdb::Grid<openvdb::tree::Usual<Value>>;                     \
  void read(const Value*) {                                                              \
    openvdb::tree::Usual<Value> tree;                                                    \
    tree.openvdb::tree::Usual<Value>::readTopology(std::cin, false);                     \
    openvdb::Grid<openvdb::tree::Usual<Value>> grid;                                     \
    grid.openvdb::Grid<openvdb::tree::Usual<Value>>::readTopology(std::cin);             \
  }

ESVR_READ(float)
ESVR_READ(double)
ESVR_READ(openvdb::math::Vec3<float>)
ESVR_READ(openvdb::math::Vec3<double>)
ESVR_READ(std::int32_t)
ESVR_READ(std::int64_t)
ESVR_READ(bool)

int main() {}
