#include "vdb/foreign_grids.h"

#include "vdb/open_vdb.h"
#include "vdb/write_nvdb.h"

#include ESVR_NANOVDB_CREATE

#include <fstream>

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

std::vector<vdb::NanoHandle> handlesOf(const std::vector<OpenVdbGrid>& grids) {
  std::vector<vdb::NanoHandle> handles;
  for (const auto& grid : grids) {
    const auto wind = openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid);
    handles.push_back(wind ? vectors(*wind) : vdb::makeNano(*grid));
  }
  return handles;
}

}  // namespace

OpenVdbGrid emptyGrid(const std::string& treeType, const std::string& name) {
  openvdb::initialize();
  auto grid = openvdb::GridBase::createGrid(treeType);
  grid->setName(name);
  return grid;
}

void saveNano(const std::filesystem::path& path, const std::vector<OpenVdbGrid>& grids,
              NanoCodec codec) {
  nanovdb::io::writeGrids(path.string(), handlesOf(grids), codecOf(codec));
}

void saveNanoBuffers(const std::filesystem::path& path, const std::vector<OpenVdbGrid>& grids) {
  std::ofstream file(path, std::ios::binary);
  for (const auto& handle : handlesOf(grids)) {
    const void* bytes = handle.buffer().data();
    file.write(static_cast<const char*>(bytes), std::streamsize(handle.buffer().size()));
  }
}

void saveNanoAs(const std::filesystem::path& path, const openvdb::GridBase& grid,
                NanoValues values) {
  nanovdb::io::writeGrid(path.string(), vdb::makeNano(grid, {values}));
}

}  // namespace esvr::test
