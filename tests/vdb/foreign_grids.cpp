#include "vdb/foreign_grids.h"

#include "vdb/open_vdb.h"
#include "vdb/write_nvdb.h"

#include ESVR_NANOVDB_CREATE

#include <cmath>
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

// Inputs for the tests of the programs.

namespace {

namespace math = openvdb::math;

math::Transform::Ptr transformOf(InputMap map) {
  constexpr double kVoxel = 0.25;
  math::Mat4d matrix = math::Mat4d::identity();
  switch (map) {
    case InputMap::kUniform:
      return math::Transform::createLinearTransform(kVoxel);
    case InputMap::kRotated:
      matrix = math::rotation<math::Mat4d>(openvdb::Vec3d(1, 2, 3).unit(), 0.7);
      break;
    case InputMap::kSheared:
      matrix.postShear(math::X_AXIS, math::Y_AXIS, 0.4);
      break;
    case InputMap::kFrustum:
      return math::Transform::createFrustumTransform(
          {openvdb::Vec3d(0), openvdb::Vec3d(100, 80, 60)}, 0.4, 2.5, kVoxel);
  }
  matrix.postTranslate(openvdb::Vec3d(1e3, -3.25, 0.1));
  return math::Transform::createLinearTransform(matrix);
}

openvdb::FloatGrid::Ptr floatGrid(const InputGrid& input) {
  auto grid = openvdb::FloatGrid::create(input.background);
  grid->setName(input.name);
  grid->setGridClass(input.levelSet ? openvdb::GRID_LEVEL_SET : openvdb::GRID_FOG_VOLUME);
  grid->setTransform(transformOf(input.map));
  grid->insertMeta("note", openvdb::StringMetadata("of " + input.name));
  auto accessor = grid->getAccessor();
  for (const auto& [at, value] : input.voxels) accessor.setValue({at.x, at.y, at.z}, value);
  for (const auto& [at, value] : input.inactive) accessor.setValueOff({at.x, at.y, at.z}, value);
  constexpr openvdb::Index kRootTile = 3;  // level in the tree
  for (const auto& [at, value] : input.largeTiles)
    accessor.addTile(kRootTile, {at.x, at.y, at.z}, value, true);
  grid->setSaveFloatAsHalf(input.half);
  return grid;
}

openvdb::GridPtrVec floatGrids(const std::vector<InputGrid>& inputs) {
  openvdb::initialize();
  openvdb::GridPtrVec grids;
  for (const auto& input : inputs) grids.push_back(floatGrid(input));
  return grids;
}

void write(const std::filesystem::path& path, const openvdb::GridPtrVec& grids) {
  openvdb::MetaMap metadata;
  metadata.insertMeta("creator", openvdb::StringMetadata(kInputCreator));
  openvdb::io::File(path.string()).write(grids, metadata);
}

template <class Grid>
openvdb::GridBase::Ptr vectorGrid(const InputVectors& input) {
  using Vector = typename Grid::ValueType;
  auto grid = Grid::create(Vector(0, 0, 0.5));
  grid->setName(input.name);
  grid->setGridClass(openvdb::GRID_STAGGERED);
  grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  grid->setTransform(transformOf(InputMap::kRotated));
  grid->insertMeta("note", openvdb::StringMetadata("of " + input.name));
  auto accessor = grid->getAccessor();
  for (const auto& [at, value] : input.voxels)
    accessor.setValue({at.x, at.y, at.z}, Vector(value * input.scale[0], value * input.scale[1],
                                                 value * input.scale[2]));
  for (const auto& [at, value] : input.inactive)
    accessor.setValueOff({at.x, at.y, at.z}, Vector(value));
  return grid;
}

template <class Value>
std::vector<InputVoxel> cube(int reach, const Value& valueAt) {
  std::vector<InputVoxel> voxels;
  for (int x = -reach; x <= reach; ++x)
    for (int y = -reach; y <= reach; ++y)
      for (int z = -reach; z <= reach; ++z)
        voxels.push_back({{x, y, z}, valueAt(std::sqrt(float(x * x + y * y + z * z)))});
  return voxels;
}

}  // namespace

void writeInput(const std::filesystem::path& path, const std::vector<InputGrid>& grids) {
  write(path, floatGrids(grids));
}

void writeVectorInput(const std::filesystem::path& path, const InputVectors& vectors,
                      const std::vector<InputGrid>& inputs) {
  openvdb::GridPtrVec grids = floatGrids(inputs);
  grids.insert(grids.begin(), vectors.asDouble ? vectorGrid<openvdb::Vec3DGrid>(vectors)
                                               : vectorGrid<openvdb::Vec3SGrid>(vectors));
  write(path, grids);
}

void writeMixedInput(const std::filesystem::path& path, const std::vector<InputGrid>& inputs) {
  openvdb::GridPtrVec grids = floatGrids(inputs);
  grids.insert(
      grids.begin(),
      {emptyGrid("Tree_bool_5_4_3", "bool"), emptyGrid("Tree_int32_5_4_3", "int32"),
       emptyGrid("Tree_vec3s_5_4_3", "vec3s"), emptyGrid("Tree_ptdataidx32_5_4_3", "points")});
  write(path, grids);
}

std::vector<InputVoxel> softBall(Coord center, float peak, float background) {
  constexpr float kRadius = 5.0f;
  std::vector<InputVoxel> ball;
  for (const auto& [at, height] : cube(int(kRadius), [](float distance) {
         return std::max(0.0f, 1.0f - distance * distance / (kRadius * kRadius));
       }))
    if (height > 0.0f) ball.push_back({at + center, background + peak * height});
  return ball;
}

std::vector<InputVoxel> cloud(int reach) {
  const float deviation = float(reach) / 3.0f;
  std::vector<InputVoxel> inside;
  for (const auto& [at, height] : cube(reach, [&](float distance) {
         return distance < float(reach)
                    ? std::exp(-distance * distance / (2.0f * deviation * deviation))
                    : 0.0f;
       }))
    if (height > 0.0f) inside.push_back({at, height});
  return inside;
}

std::vector<InputVoxel> distances(int reach) {
  constexpr float kRadius = 8.0f;
  return cube(reach, [](float distance) { return distance - kRadius; });
}

}  // namespace esvr::test
