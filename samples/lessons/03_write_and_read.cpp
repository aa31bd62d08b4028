// Lesson 3: .esvr files.
//
// A file holds grids: the ellipsoids, and the name, class, transform and metadata of each grid.

#include <cstdio>
#include <filesystem>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/fit.h"
#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"
#include "ring.h"

int main() {
  const esvr::SparseVolume ring = makeRing();
  esvr::FitOptions options;
  options.count = 40;
  options.preset = esvr::Preset::kDraft;

  // readGrid() returns a descriptor with each grid; this one is made from scratch.
  esvr::GridDescriptor descriptor;
  descriptor.name = "density";
  descriptor.gridClass = esvr::GridClass::kFogVolume;
  descriptor.transform = esvr::uniformTransform(0.1);

  // makeStoredGrid adds the rule by which a reader determines the active voxels.
  esvr::EsvrFile file;
  file.metadata.push_back(esvr::stringItem("creator", "lesson 3"));
  file.grids.push_back(esvr::makeStoredGrid(descriptor, ring, esvr::fit(ring, options).field));

  const std::filesystem::path path = "lesson_03.esvr";
  const auto bytes = esvr::writeEsvr(path, file, {.overwrite = true});
  std::printf("%llu bytes\n", static_cast<unsigned long long>(bytes));

  // Writers do not replace a file by default, and every error text names the file.
  bool refused = false;
  try {
    esvr::writeEsvr(path, file);
  } catch (const esvr::Error& error) {
    std::printf("refused: %s\n", error.what());
    refused = true;
  }
  check(refused, "an existing file is kept");

  const esvr::EsvrFile read = esvr::readEsvr(path);
  check(read.grids.size() == 1, "the file has one grid");
  check(read.grids[0].descriptor == descriptor, "its descriptor is unchanged");
  check(read.grids[0].field.ellipsoidCount() == file.grids[0].field.ellipsoidCount(),
        "it has all its ellipsoids");
  std::filesystem::remove(path);
}
