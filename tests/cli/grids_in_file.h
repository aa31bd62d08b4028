#pragma once
/// What tests compare of the grids in a .vdb file that are not fitted.

#include <cstddef>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "esvr/vdb_io.h"
#include "vdb/carried_bytes.h"

namespace esvr::test {

inline std::vector<std::string> namesIn(const std::string& path) {
  std::vector<std::string> names;
  for (const auto& grid : inspectVdb(path).grids) names.push_back(grid.uniqueName);
  return names;
}

/// The grids of a .vdb file as bytes, without their places and the version of the format.
inline std::vector<CarriedGrid> bytesIn(const std::string& path,
                                        std::vector<std::size_t> places = {}) {
  if (places.empty()) {
    places.resize(inspectVdb(path).grids.size());
    std::iota(places.begin(), places.end(), std::size_t{0});
  }
  auto grids = readCarried(path, places);
  for (auto& grid : grids) grid.place = 0;
  return withoutVersion(std::move(grids));
}

}  // namespace esvr::test
