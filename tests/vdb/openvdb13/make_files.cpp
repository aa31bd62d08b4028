// Wrote the files of this folder, which foreign_files_test.cpp reads, with OpenVDB 13.0.0 and its NanoVDB 32.9.0 (both
// of the tag v13.0.0). It is no part of the build, since the distributions have older versions. To run it, configure
// OpenVDB with -D USE_BLOSC=ON -D OPENVDB_CORE_STATIC=ON, install it to PREFIX, and
//
//   g++ -std=c++17 -DNANOVDB_USE_OPENVDB -DNANOVDB_USE_BLOSC -DNANOVDB_USE_ZIP -I PREFIX/include make_files.cpp \
//     PREFIX/lib/libopenvdb.a -ltbb -lblosc -lz && ./a.out .

#include <nanovdb/NanoVDB.h>
#include <nanovdb/io/IO.h>
#include <nanovdb/tools/CreateNanoGrid.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>
#include <filesystem>
#include <fstream>

namespace {

using openvdb::GridCPtrVec;

/// The values of all grids; multiples of 1/16, so that half floats hold them.
float valueAt(int x, int y, int z) {
  return float(13 - std::abs(x - 6) - std::abs(y - 6) - std::abs(z - 6)) / 16.0f;
}

/// A grid with these values where they are positive, an active tile of a half, and a background of 0.
template <class Grid>
typename Grid::Ptr gridOf(const std::string& name, typename Grid::ValueType (*make)(float)) {
  auto grid = Grid::create(make(0.0f));
  grid->setName(name);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  grid->insertMeta("author", openvdb::StringMetadata("OpenVDB 13"));
  for (int x = 0; x < 13; ++x)
    for (int y = 0; y < 13; ++y)
      for (int z = 0; z < 13; ++z)
        if (valueAt(x, y, z) > 0) grid->tree().setValueOn({x, y, z}, make(valueAt(x, y, z)));
  grid->tree().addTile(1, {64, 0, 0}, make(0.5f), true);
  return grid;
}

auto floats(const std::string& name) {
  return gridOf<openvdb::FloatGrid>(name, [](float v) { return v; });
}
auto doubles(const std::string& name) {
  return gridOf<openvdb::DoubleGrid>(name, [](float v) { return double(v); });
}
auto halfs() {
  return gridOf<openvdb::HalfGrid>("density", [](float v) { return openvdb::Half(v); });
}
auto vectors() {
  auto grid =
      gridOf<openvdb::Vec3SGrid>("vel", [](float v) { return openvdb::Vec3s(v, -v, 2 * v); });
  grid->setGridClass(openvdb::GRID_STAGGERED);
  grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  return grid;
}
auto floatsAsHalfs(const std::string& name) {
  auto grid = floats(name);
  grid->setSaveFloatAsHalf(true);
  return grid;
}
auto levelSet() {
  auto grid =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(6.0f, openvdb::Vec3f(8, 8, 8), 1.0f);
  grid->setName("surface");
  return grid;
}

void write(const std::filesystem::path& path, const GridCPtrVec& grids, std::uint32_t compression) {
  openvdb::io::File file(path.string());
  file.setCompression(compression);
  openvdb::MetaMap metadata;
  metadata.insertMeta("creator", openvdb::StringMetadata("OpenVDB 13.0.0"));
  file.write(grids, metadata);
}

void writeOpenVdb(const std::filesystem::path& folder) {
  using namespace openvdb::io;
  const auto flags = gridOf<openvdb::BoolGrid>("flags", [](float v) { return v > 0.25f; });
  write(folder / "grids.vdb",
        {floatsAsHalfs("density"), halfs(), doubles("temperature"), vectors(), flags, levelSet()},
        COMPRESS_ACTIVE_MASK | COMPRESS_BLOSC);
  write(folder / "half_mask.vdb", {halfs()}, COMPRESS_ACTIVE_MASK);
  auto unknown = halfs();
  unknown->setGridClass(openvdb::GRID_UNKNOWN);  // no other class is zipped
  write(folder / "half_zip.vdb", {unknown}, COMPRESS_ACTIVE_MASK | COMPRESS_ZIP);
  write(folder / "half_blosc.vdb", {halfs()}, COMPRESS_ACTIVE_MASK | COMPRESS_BLOSC);
  std::ofstream file(folder / "stream.vdb", std::ios::binary);
  Stream stream(file);
  stream.write(GridCPtrVec{floats("smoke"), halfs(), vectors()});
}

template <class Value>
auto nano() {
  return nanovdb::tools::createNanoGrid<openvdb::FloatGrid, Value>(*floats("density"));
}

void writeNanoVdb(const std::filesystem::path& folder) {
  using nanovdb::tools::createNanoGrid;
  std::vector<nanovdb::GridHandle<nanovdb::HostBuffer>> handles;
  handles.push_back(createNanoGrid(*floats("density")));
  handles.push_back(createNanoGrid(*vectors()));
  handles.push_back(createNanoGrid(*doubles("temperature")));
  handles.push_back(createNanoGrid(*levelSet()));
  handles.push_back(nano<nanovdb::ValueOnIndex>());
  nanovdb::io::writeGrids((folder / "grids.nvdb").string(), handles, nanovdb::io::Codec::BLOSC);
  handles.clear();
  handles.push_back(nano<nanovdb::Fp4>());
  handles.push_back(nano<nanovdb::Fp8>());
  handles.push_back(nano<nanovdb::Fp16>());
  handles.push_back(nano<nanovdb::FpN>());
  const auto merged = nanovdb::mergeGrids<nanovdb::HostBuffer>(handles);
  nanovdb::io::writeGrid((folder / "quantised.nvdb").string(), merged, nanovdb::io::Codec::ZIP);
}

}  // namespace

int main(int, char** arguments) {
  openvdb::initialize();
  writeOpenVdb(arguments[1]);
  writeNanoVdb(arguments[1]);
}
