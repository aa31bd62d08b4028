#include "vdb/made_files.h"

#include <cmath>
#include <stdexcept>

#include "esvr/error.h"

namespace esvr::test {

openvdb::FloatGrid::Ptr smallGrid(float background) {
  openvdb::initialize();
  auto grid = openvdb::FloatGrid::create(background);
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  auto accessor = grid->getAccessor();
  accessor.setValue({1, 2, 3}, 0.25f);
  accessor.setValue({1, 2, 4}, 0.5f);
  accessor.setValue({7, 0, 0}, 1.0f);
  return grid;
}

void save(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
          const openvdb::MetaMap& metadata) {
  openvdb::io::File(path.string()).write(grids, metadata);
}

void saveCompressed(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
                    std::uint32_t compression) {
  openvdb::io::File file(path.string());
  file.setCompression(compression);
  file.write(grids);
}

openvdb::GridBase::Ptr load(const std::filesystem::path& path, const std::string& name) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(false);
  return file.readGrid(name);
}

VolumeGrid gridOf(const std::string& name, const std::vector<Voxel>& voxels, float background) {
  VolumeGrid grid;
  grid.descriptor.name = name;
  grid.descriptor.background = background;
  grid.descriptor.transform = uniformTransform(1.0);
  grid.volume = volumeOf(voxels, background);
  return grid;
}

void expectSame(const VolumeGrid& actual, const VolumeGrid& expected) {
  EXPECT_EQ(actual.descriptor, expected.descriptor);
  EXPECT_EQ(volumeDifference(actual.volume, expected.volume), "");
}

bool readable(const std::filesystem::path& path, const ReadOptions& options) {
  try {
    for (const auto& listed : inspectVdb(path).grids) {
      if (!listed.skipReason.empty()) continue;
      const auto grid = readGrid(path, listed.uniqueName, options);
      checkInvariants(grid.volume);
      for (const float value : grid.volume.values)
        if (!std::isfinite(value)) throw std::logic_error("a value that is not finite");
    }
  } catch (const BadInput&) {
    return false;
  } catch (const MemoryExceeded&) {
    return false;
  }
  return true;
}

}  // namespace esvr::test
