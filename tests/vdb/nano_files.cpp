#include "vdb/nano_files.h"

#include "vdb/versions.h"

#include ESVR_NANOVDB_CREATE
#include ESVR_NANOVDB_IO

namespace esvr::test {
namespace {

using Handles = std::vector<nanovdb::GridHandle<nanovdb::HostBuffer>>;

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

template <class Build>
nanovdb::GridHandle<nanovdb::HostBuffer> quantised(openvdb::FloatGrid& grid) {
#ifdef ESVR_NANOVDB_HAS_CREATE
  return vdb::nanotools::createNanoGrid<openvdb::FloatGrid, Build>(grid);
#else
  return nanovdb::OpenToNanoVDB<float, Build>()(grid);
#endif
}

nanovdb::GridHandle<nanovdb::HostBuffer> quantised(openvdb::FloatGrid& grid, NanoFloats floats) {
  switch (floats) {
    case NanoFloats::kFp4:
      return quantised<nanovdb::Fp4>(grid);
    case NanoFloats::kFp8:
      return quantised<nanovdb::Fp8>(grid);
    case NanoFloats::kFp16:
      return quantised<nanovdb::Fp16>(grid);
    case NanoFloats::kFpN:
      break;
  }
  return quantised<nanovdb::FpN>(grid);
}

}  // namespace

void saveNano(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
              NanoCodec codec) {
  Handles handles;
  for (const auto& grid : grids) handles.push_back(vdb::nanotools::openToNanoVDB(grid));
  nanovdb::io::writeGrids(path.string(), handles, codecOf(codec));
}

void saveQuantised(const std::filesystem::path& path, openvdb::FloatGrid& grid, NanoFloats floats) {
  Handles handles;
  handles.push_back(quantised(grid, floats));
  nanovdb::io::writeGrids(path.string(), handles);
}

}  // namespace esvr::test
