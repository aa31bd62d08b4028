#include "kinds/density_grid.h"

#include <utility>

namespace esvr::samples {

VolumeGrid densityGrid(SparseVolume volume, const Transform& transform, const std::string& name) {
  VolumeGrid grid;
  grid.descriptor.name = name;
  grid.descriptor.gridClass = GridClass::kFogVolume;
  grid.descriptor.valueType = ValueType::kFloat;
  grid.descriptor.background = double(volume.background);
  grid.descriptor.transform = transform;
  grid.volume = std::move(volume);
  return grid;
}

}  // namespace esvr::samples
