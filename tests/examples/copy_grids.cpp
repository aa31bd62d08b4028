// copy_grids IN.vdb OUT.vdb NAME...: writes the first grid of a file under each name. A file with
// grids of several names is the input of some examples.

#include <exception>
#include <iostream>
#include <vector>

#include "esvr/vdb_io.h"

int main(int argc, char** argv) try {
  const esvr::VolumeGrid grid =
      esvr::readGrid(argv[1], esvr::inspectVdb(argv[1]).grids.at(0).uniqueName);
  std::vector<esvr::VolumeGrid> copies;
  for (int i = 3; i < argc; ++i) {
    copies.push_back(grid);
    copies.back().descriptor.name = argv[i];
  }
  esvr::writeGrids(argv[2], {}, copies);
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
