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

}  // namespace

void writeNanoVdb(const std::filesystem::path& path, std::span<const VolumeGrid> grids,
                  const WriteOptions& options) {
  for (const auto& grid : grids) refuseWhatNanoVdbLacks(grid, options);
  WriteOptions whole = options;
  whole.half = HalfMode::kOff;
  std::vector<NanoHandle> handles;
  for (const auto& grid : grids) handles.push_back(makeNano(*makeOpenVdbGrid(grid, whole)));

  std::ofstream stream(path, std::ios::binary);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  nanovdb::io::writeGrids(stream, handles, nanovdb::io::Codec::ZIP);
  stream.close();
}

}  // namespace esvr::vdb
