#include "render/view/view_files.h"

#include <cmath>
#include <span>

#include "esvr/field.h"
#include "esvr/frame_coding.h"
#include "esvr/grid_coding.h"
#include "esvr/sequence_file.h"
#include "esvr/vdb_io.h"
#include "field/random_field.h"

namespace esvr::test {
namespace {

GridDescriptor density() {
  GridDescriptor d;
  d.name = "density";
  d.gridClass = GridClass::kFogVolume;
  d.transform = uniformTransform(0.5);
  return d;
}

Field blob(std::uint64_t seed) {
  Field field =
      randomField({.count = 8, .extent = 16.0, .smallest = 3.0, .aspect = 2.0, .seed = seed});
  for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
  return field;
}

EsvrFile fileOf(const Field& field) {
  return {{}, {makeStoredGrid(density(), revoxelise(field, {}), field)}};
}

void writeFrames(const std::filesystem::path& path) {
  SequenceWriter writer(path);
  for (const std::int64_t number : {7, 9}) {
    writer.append(number, encodeFrame(fileOf(blob(std::uint64_t(number))), nullptr));
    writer.endGroup();
  }
  writer.finish();
}

}  // namespace

ViewFiles::ViewFiles() {
  const Field field = blob(7);
  writeEsvr(folder_ / "blob.esvr", fileOf(field));
  const VolumeGrid grid{density(), revoxelise(field, {}), 0};
  writeGrids(folder_ / "blob.vdb", {}, std::span(&grid, 1));
  writeFrames(folder_ / "frames.esvr");
}

}  // namespace esvr::test
