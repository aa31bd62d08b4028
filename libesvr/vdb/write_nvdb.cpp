#include "vdb/write_nvdb.h"

#include <fstream>

#include "esvr/error.h"
#include "vdb/make_nano.h"
#include "vdb/volume_to_tree.h"

namespace esvr::vdb {
namespace {

void refuseWhatNanoVdbLacks(const VolumeGrid& grid, const WriteOptions& options) {
  const std::string name = "grid \"" + grid.descriptor.name + "\": ";
  if (options.half == HalfMode::kOn)
    throw UsageError(name + ".nvdb files are not written as half; ask for .vdb");
  if (!grid.descriptor.transform.affine)
    throw UsageError(name + "a .nvdb holds affine transforms only, this one is a " +
                     grid.descriptor.transform.mapType + "; ask for .vdb");
}

std::vector<const VolumeGrid*> volumesOf(std::span<const GridToWrite> grids) {
  std::vector<const VolumeGrid*> volumes;
  for (const auto& grid : grids) {
    if (const auto* carried = std::get_if<const CarriedGrid*>(&grid))
      throw UsageError("grid \"" + (*carried)->name + "\" (" + (*carried)->treeType +
                       ") is carried unchanged, which a .nvdb file cannot hold; ask for .vdb");
    if (const auto* vectors = std::get_if<const VectorGrid*>(&grid))
      throw UsageError("grid \"" + (*vectors)->descriptor.name +
                       "\" has vectors, which are not written to .nvdb files; ask for .vdb");
    if (const auto* packed = std::get_if<const PackedGrid*>(&grid))
      throw UsageError("grid \"" + (*packed)->descriptor.name +
                       "\" holds packed voxels, which are not written to .nvdb files; unpack them");
    volumes.push_back(std::get<const VolumeGrid*>(grid));
  }
  return volumes;
}

}  // namespace

void writeNanoVdb(const std::filesystem::path& path, std::span<const GridToWrite> grids,
                  const WriteOptions& options) {
  const auto volumes = volumesOf(grids);
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
