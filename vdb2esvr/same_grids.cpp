#include "vdb2esvr/same_grids.h"

#include <algorithm>

namespace esvr::vdb2esvr {
namespace {

bool areAlike(const StoredGrid& a, const StoredGrid& b) {
  const GridDescriptor &of = a.descriptor, &other = b.descriptor;
  return of.name == other.name && of.gridClass == other.gridClass &&
         of.valueType == other.valueType && of.transform == other.transform;
}

bool areAlikeCarried(const CarriedGrid& a, const CarriedGrid& b) {
  return a.name == b.name && a.treeType == b.treeType && a.place == b.place;
}

}  // namespace

bool haveSameGrids(const EsvrFile& a, const EsvrFile& b) {
  return std::ranges::equal(a.grids, b.grids, areAlike) &&
         std::ranges::equal(a.carried, b.carried, areAlikeCarried) && a.vectors == b.vectors;
}

}  // namespace esvr::vdb2esvr
