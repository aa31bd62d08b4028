// Lesson 7: Gaussian splats.
//
// Viewers of splats composite thousands of Gaussians with an opacity and a color. The ellipsoids of a grid become
// splats of the same optical depth, and splats of any origin become a density.

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "esvr/encode.h"
#include "esvr/splats.h"
#include "esvr/vdb_io.h"
#include "ring.h"

namespace {

double sumOf(const esvr::SparseVolume& volume) {
  double sum = 0.0;
  for (const float value : volume.values) sum += double(value);
  return sum;
}

}  // namespace

int main() {
  // A stored grid of ellipsoids.
  const esvr::SparseVolume ring = makeRing();
  esvr::GridDescriptor descriptor;
  descriptor.name = "density";
  descriptor.gridClass = esvr::GridClass::kFogVolume;
  descriptor.transform = esvr::uniformTransform(0.1);
  esvr::ConvertOptions convert;
  convert.goal = esvr::FitGoal{};
  convert.fit.count = 40;
  convert.fit.preset = esvr::Preset::kDraft;
  convert.representation = esvr::Representation::kEllipsoids;
  const esvr::StoredGrid grid = esvr::convertVolume({descriptor, ring}, convert).grid;

  // Its splats, in the colors of a map over its values, as a file for viewers.
  esvr::SplatOptions options;
  options.colors = esvr::builtInColorMap("inferno");
  const esvr::MadeSplats made = esvr::makeSplats(grid, options);
  const auto path = std::filesystem::temp_directory_path() / "esvr_lesson_ring.ply";
  esvr::writeSplats(path, made.scene, esvr::SplatForm::kPly, true);
  std::printf("%zu splats of %zu ellipsoids\n", made.scene.splats.size(),
              std::size_t(made.ellipsoids));

  // The density of the splats in the file, at voxels of the size of the ring's.
  const esvr::SplatFile file = esvr::readSplats(path);
  std::filesystem::remove(path);
  const esvr::SplatGrids grids = esvr::makeSplatGrids(file.scene, {.voxelSize = 0.1});
  const double back = sumOf(grids.density.volume), wanted = sumOf(ring);
  std::printf("sum of the density: %.0f, of the ring %.0f\n", back, wanted);
  check(std::abs(back - wanted) < 0.05 * wanted, "the splats have the mass of the ring");
  check(grids.color.has_value(), "they have colors");
}
