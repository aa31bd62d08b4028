#include "vdb/empty_grid.h"

#include <openvdb/openvdb.h>

namespace esvr::test {

openvdb::GridBase::Ptr emptyGrid(const std::string& treeType, const std::string& name) {
  openvdb::initialize();
  auto grid = openvdb::GridBase::createGrid(treeType);
  grid->setName(name);
  return grid;
}

}  // namespace esvr::test
