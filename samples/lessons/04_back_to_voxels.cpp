// Lesson 4: from ellipsoids back to voxels.
//
// The field is defined everywhere. The library evaluates it in any bricks, or converts it to a
// volume.

#include <cmath>
#include <cstdio>
#include <vector>

#include "esvr/field.h"
#include "esvr/fit.h"
#include "ring.h"

int main() {
  const esvr::SparseVolume ring = makeRing();
  esvr::FitOptions options;
  options.count = 40;
  options.preset = esvr::Preset::kDraft;
  const esvr::Field field = esvr::fit(ring, options).field;

  // Values in one brick, in the order of voxelOffset.
  const esvr::Coord corner{16, 0, 0};
  std::vector<float> values(esvr::kBrickVoxels);
  esvr::evaluateBricks(field, std::vector{corner}, values);
  const esvr::Coord onTheCircle{16, 0, 0};
  const float value = values[std::size_t(esvr::voxelOffset(onTheCircle - corner))];
  std::printf("at %s: %.3f, the ring has %.3f\n", esvr::toString(onTheCircle).c_str(),
              double(value), double(esvr::valueAt(ring, onTheCircle)));
  check(std::abs(value - esvr::valueAt(ring, onTheCircle)) < 0.1f,
        "the value is close to the ring's");

  // evaluateReference evaluates the definition in float64. It is slow; tests compare with it.
  const double reference = esvr::evaluateReference(field, onTheCircle);
  check(std::abs(double(value) - reference) < 1e-4, "it is even closer to the definition");

  // Converts the whole field. Voxels below the threshold are not active.
  esvr::RevoxeliseOptions revoxelise;
  revoxelise.threshold = 0.05f;
  revoxelise.range = esvr::ValueRange{0.0f, 1.0f};  // no voxel of the ring lies beyond
  const esvr::SparseVolume back = esvr::revoxelise(field, revoxelise);
  std::printf("%zu bricks, the ring has %zu\n", back.brickCount(), ring.brickCount());
  check(esvr::activeVoxelCount(back) > 0, "the volume has active voxels");
  check(esvr::valueAt(back, {0, 0, 0}) == 0.0f, "the ring's hole is still empty");
}
