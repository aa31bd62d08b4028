#include "vdb/write_nvdb.h"

#include <deque>
#include <fstream>

#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "vdb/make_nano.h"
#include "vdb/volume_to_tree.h"

namespace esvr::vdb {
namespace {

void refuseWhatNanoVdbLacks(const VolumeGrid& grid, const WriteOptions& options) {
  const std::string name = "grid \"" + shownName(grid.descriptor.name) + "\": ";
  if (options.half == HalfMode::kOn)
    throw UsageError(name + ".nvdb files are not written as half; ask for .vdb");
  if (!grid.descriptor.transform.affine)
    throw UsageError(name + "a .nvdb holds affine transforms only, this one is a " +
                     grid.descriptor.transform.mapType + "; ask for .vdb");
}

VolumeGrid unpackedGrid(const PackedGrid& grid) {
  const auto* voxels = std::get_if<PackedVoxels<float>>(&grid.voxels);
  if (!voxels)
    throw UsageError("grid \"" + shownName(grid.descriptor.name) + "\" has values of type " +
                     valueTypeOf(grid) + ", which are not written to .nvdb files; ask for .vdb");
  VolumeGrid volume{grid.descriptor, unpacked(*voxels)};
  volume.descriptor.background = double(voxels->background);
  return volume;
}

/// \param unpackedGrids  gets the volumes of packed grids
std::vector<const VolumeGrid*> volumesOf(std::span<const GridToWrite> grids,
                                         std::deque<VolumeGrid>& unpackedGrids) {
  std::vector<const VolumeGrid*> volumes;
  for (const auto& grid : grids) {
    if (const auto* carried = std::get_if<const CarriedGrid*>(&grid))
      throw UsageError("grid \"" + shownName((*carried)->name) + "\" (" +
                       shownName((*carried)->treeType) +
                       ") is carried unchanged, which a .nvdb file cannot hold; ask for .vdb");
    if (const auto* vectors = std::get_if<const VectorGrid*>(&grid))
      throw UsageError("grid \"" + shownName((*vectors)->descriptor.name) +
                       "\" has vectors, which are not written to .nvdb files; ask for .vdb");
    if (const auto* packed = std::get_if<const PackedGrid*>(&grid))
      volumes.push_back(&unpackedGrids.emplace_back(unpackedGrid(**packed)));
    else
      volumes.push_back(std::get<const VolumeGrid*>(grid));
  }
  return volumes;
}

}  // namespace

void writeNanoVdb(const std::filesystem::path& path, std::span<const GridToWrite> grids,
                  const WriteOptions& options) {
  if (grids.empty()) throw BadInput("a .nvdb file cannot be written without a grid; ask for .vdb");
  std::deque<VolumeGrid> unpackedGrids;
  const auto volumes = volumesOf(grids, unpackedGrids);
  for (const VolumeGrid* grid : volumes) refuseWhatNanoVdbLacks(*grid, options);
  WriteOptions whole = options;
  whole.half = HalfMode::kOff;
  std::vector<NanoHandle> handles;
  for (const VolumeGrid* grid : volumes)
    handles.push_back(makeNano(*makeOpenVdbGrid(*grid, whole)));

  std::ofstream stream(path, std::ios::binary);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  nanovdb::io::writeGrids(stream, handles, nanovdb::io::Codec::ZIP);
  stream.close();
}

}  // namespace esvr::vdb
