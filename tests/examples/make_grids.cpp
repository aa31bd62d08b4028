// Makes inputs of examples.
//
//   make_grids IN.vdb OUT.vdb NAME...   the first grid of a file under each name; every 50th voxel of one whose name
//                                       ends in "_with_gaps" is NaN
//   make_grids IN.raw OUT.vdb SIDE      a grid of SIDE^3 floats that follow each other with x fastest, all active

#include <exception>
#include <fstream>
#include <iostream>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "esvr/vdb_io.h"

namespace {

void copyGrid(const char* from, const char* to, std::span<char*> names) {
  const esvr::VolumeGrid grid = esvr::readGrid(from, 0);
  std::vector<esvr::VolumeGrid> copies;
  for (const std::string name : names) {
    copies.push_back(grid);
    copies.back().descriptor.name = name;
    constexpr std::size_t kStep = 50;
    esvr::SparseVolume& volume = copies.back().volume;
    for (std::size_t v = 0; name.ends_with("_with_gaps") && v < volume.values.size(); v += kStep)
      if (volume.active[v / esvr::kBrickVoxels].test(int(v % esvr::kBrickVoxels)))
        volume.values[v] = std::numeric_limits<float>::quiet_NaN();
  }
  esvr::writeGrids(to, {}, copies);
}

void makeFromRaw(const char* from, const char* to, int side) {
  std::vector<float> voxels(std::size_t(side) * std::size_t(side) * std::size_t(side));
  std::ifstream file(from, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(voxels.data()),
                 std::streamsize(voxels.size() * sizeof(float))))
    throw std::runtime_error("the file has too few voxels");
  esvr::GridPacker<float> packer(0.0f, {.threshold = -1.0});
  const esvr::ImageBox<float> box{
      voxels.data(), {1, side, std::ptrdiff_t(side) * side}, {}, {side, side, side}};
  packer.add(std::span(&box, 1));
  esvr::PackedGrid grid{{}, packer.finish()};
  grid.descriptor.name = "density";
  grid.descriptor.gridClass = esvr::GridClass::kFogVolume;
  grid.descriptor.transform = esvr::uniformTransform(1.0);
  const std::vector<esvr::GridToWrite> grids{&grid};
  esvr::writeGrids(to, {}, grids);
}

}  // namespace

int main(int argc, char** argv) try {
  if (std::string(argv[1]).ends_with(".raw"))
    makeFromRaw(argv[1], argv[2], std::stoi(argv[3]));
  else
    copyGrid(argv[1], argv[2], std::span(argv + 3, argv + argc));
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
