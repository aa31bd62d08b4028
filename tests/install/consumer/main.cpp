// Builds a volume of two voxels that are 16 apart along x, and prints their bounding box.
#include <esvr/device.h>
#include <esvr/volume.h>

#include <iostream>

namespace {

esvr::BrickInput brickWithOneVoxel(esvr::Coord voxel) {
  esvr::BrickInput brick{};
  brick.corner = esvr::brickOf(voxel) * esvr::kBrickSide;
  const int offset = esvr::voxelOffset(esvr::localOf(voxel));
  brick.values[offset] = 1.0f;
  brick.active.set(offset);
  return brick;
}

}  // namespace

int main() {
  const auto volume =
      esvr::makeVolume({brickWithOneVoxel({14, 5, 10}), brickWithOneVoxel({-2, 5, 10})}, 0.0f);
  const auto box = esvr::activeBox(volume);
  std::cout << "active box " << esvr::toString(box.min) << " to " << esvr::toString(box.max) << ", "
            << (esvr::builtWithCuda() ? "CUDA built in" : "no CUDA") << ", package says "
            << PACKAGE_CUDA << "\n";
}
