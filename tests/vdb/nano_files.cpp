#include "vdb/nano_files.h"

#include "vdb/make_nano.h"
#include "vdb/trees.h"

#include ESVR_NANOVDB_CREATE

namespace esvr::test {
namespace {

nanovdb::io::Codec codecOf(NanoCodec codec) {
  switch (codec) {
    case NanoCodec::kZip:
      return nanovdb::io::Codec::ZIP;
    case NanoCodec::kBlosc:
      return nanovdb::io::Codec::BLOSC;
    case NanoCodec::kNone:
      break;
  }
  return nanovdb::io::Codec::NONE;
}

vdb::NanoHandle vectors(const openvdb::Vec3SGrid& grid) {
#ifdef ESVR_NANOVDB_HAS_CREATE
  return vdb::nanotools::createNanoGrid<openvdb::Vec3SGrid>(grid);
#else
  return nanovdb::OpenToNanoVDB<openvdb::Vec3f, nanovdb::Vec3f>()(grid);
#endif
}

vdb::NanoHandle handleOf(const openvdb::GridBase& grid) {
  return grid.isType<openvdb::Vec3SGrid>() ? vectors(static_cast<const openvdb::Vec3SGrid&>(grid))
                                           : vdb::makeNano(grid);
}

}  // namespace

void saveNano(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
              NanoCodec codec) {
  std::vector<vdb::NanoHandle> handles;
  for (const auto& grid : grids) handles.push_back(handleOf(*grid));
  nanovdb::io::writeGrids(path.string(), handles, codecOf(codec));
}

void saveNanoAs(const std::filesystem::path& path, const openvdb::GridBase& grid,
                NanoValues values) {
  nanovdb::io::writeGrid(path.string(), vdb::makeNano(grid, {values}));
}

}  // namespace esvr::test
