#include "compare/row_renderer.h"

namespace esvr::compare {

std::unique_ptr<Renderer> makeVoxelRenderer(const SparseVolume& volume, NanoValues values,
                                            const Device& device) {
  if (device.kind == DeviceKind::kCpu) return makeVolumeRenderer(volume, device);
  VolumeGrid grid;
  grid.descriptor.background = volume.background;
  grid.descriptor.transform = uniformTransform(1.0);  // pictures are drawn in index space
  grid.volume = volume;
  return makeNanoRenderer(makeNanoVolume(grid, values), device);
}

}  // namespace esvr::compare
