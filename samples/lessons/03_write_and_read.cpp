// Lesson 3: .esvr files.
//
// A file holds grids: the ellipsoids, and all that makes the grid what it was, its name, class,
// transform and metadata.

#include <cstdio>
#include <filesystem>

#include "check.h"
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

  // A grid read by readGrid() has a descriptor already; this one is made from scratch.
  esvr::GridDescriptor descriptor;
  descriptor.name = "density";
  descriptor.gridClass = esvr::GridClass::kFogVolume;
  descriptor.transform = esvr::uniformTransform(0.1);

  // makeStoredGrid adds what is needed to find the active voxels again.
  esvr::EsvrFile file;
  file.metadata.push_back(esvr::stringItem("creator", "lesson 3"));
  file.grids.push_back(esvr::makeStoredGrid(descriptor, ring, esvr::fit(ring, options).field));

  const std::filesystem::path path = "lesson_03.esvr";
  const auto bytes = esvr::writeEsvr(path, file, {.overwrite = true});
  std::printf("%llu bytes\n", static_cast<unsigned long long>(bytes));

  // Writers never replace a file unasked, and every error says what it is about.
  bool refused = false;
  try {
    esvr::writeEsvr(path, file);
  } catch (const esvr::Error& error) {
    std::printf("refused: %s\n", error.what());
    refused = true;
  }
  check(refused, "an existing file is kept");

  const esvr::EsvrFile read = esvr::readEsvr(path);
  check(read.grids.size() == 1, "one grid comes back");
  check(read.grids[0].descriptor == descriptor, "it is what it was");
  check(read.grids[0].field.ellipsoidCount() == file.grids[0].field.ellipsoidCount(),
        "with all its ellipsoids");
  std::filesystem::remove(path);
}
