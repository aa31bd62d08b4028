#include "generators/sample_kinds.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>

#include "esvr/did_you_mean.h"
#include "esvr/error.h"
#include "generators/paper_volumes.h"
#include "generators/shapes.h"
#include "generators/tubes.h"

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

namespace {

constexpr const char* kCreator = "esvr-sample";
/// Blender reads files as Y-up if their creator begins with "Houdini". A converter that loses this
/// item turns the scene.
constexpr const char* kHoudiniCreator = "Houdini (as written by esvr-sample)";
constexpr float kTemperatureBackground = 0.25f;

double voxelSize(const SampleOptions& options) { return kWorldSize / options.resolution; }

MetaItem floatItem(const std::string& name, float value) {
  MetaItem item{name, "float", {}};
  const auto bytes = std::bit_cast<std::array<std::byte, sizeof value>>(value);
  item.value.assign(bytes.begin(), bytes.end());
  return item;
}

/// A transform with a scale, a rotation about z by the angle of the triangle 3-4-5, and an offset.
Transform rotatedTransform(double size) {
  const double c = 0.8 * size, s = 0.6 * size;
  return affineTransform({c, s, 0, 0, -s, c, 0, 0, 0, 0, size, 0, 1.5, -2.5, 10, 1});
}

template <SparseVolume (*make)(const SampleOptions&)>
SampleFile oneDensity(const SampleOptions& options) {
  SampleFile file;
  file.metadata.push_back(stringItem("creator", kCreator));
  file.grids.push_back(densityGrid(make(options), uniformTransform(voxelSize(options))));
  return file;
}

SparseVolume blobsOnZero(const SampleOptions& options) { return makeBlobs(options); }

SampleFile levelSet(const SampleOptions& options) {
  const double size = voxelSize(options);
  SampleFile file;
  file.metadata.push_back(stringItem("creator", kCreator));
  file.grids.push_back(densityGrid(makeLevelSet(options, size), uniformTransform(size), "surface"));
  file.grids.back().descriptor.gridClass = GridClass::kLevelSet;
  return file;
}

SampleFile twoGrids(const SampleOptions& options) {
  const double size = voxelSize(options);
  VolumeGrid density = densityGrid(makePlume(options), rotatedTransform(size));
  density.descriptor.valueType = ValueType::kHalf;
  density.descriptor.metadata = {stringItem("sample_note", "turned, moved and saved as half"),
                                 floatItem("sample_exposure", 1.25f)};
  VolumeGrid temperature = densityGrid(makeBlobs(options, kTemperatureBackground),
                                       uniformTransform(2.0 * size), "temperature");
  temperature.descriptor.metadata = {stringItem("sample_unit", "kilokelvin")};

  SampleFile file;
  file.metadata = {stringItem("creator", kHoudiniCreator), floatItem("sample_time", 0.5f)};
  file.grids.push_back(std::move(density));
  file.grids.push_back(std::move(temperature));
  return file;
}

constexpr SampleKind kKinds[] = {
    {"tree", "branching vessels: sparse, soft-edged tubes", oneDensity<makeTree>},
    {"plume", "a noisy smoke plume, which rises from frame to frame", oneDensity<makePlume>, true},
    {"blobs", "diffuse blobs without an edge", oneDensity<blobsOnZero>},
    {"levelset", "a level set: signed distances in a narrow band", levelSet},
    {"two-grids", "density (half, turned) and temperature (background 0.25), with metadata",
     twoGrids},
    {"8area", "like the paper's 8area: eight dense chunks", oneDensity<makeEightAreas>},
    {"empty-sphere", "like the paper's EmptySphere: a thin shell", oneDensity<makeEmptySphere>},
    {"synth-tube", "like the paper's SynthTube: straight tubes", oneDensity<makeSynthTube>},
    {"synth-wiggle", "like the paper's SynthWiggle: winding tubes", oneDensity<makeSynthWiggle>},
    {"diffuse-scalar", "like the paper's DiffuseScalar: a ball with a diffuse boundary",
     oneDensity<makeDiffuseScalar>},
};

}  // namespace

std::span<const SampleKind> sampleKinds() { return kKinds; }

const SampleKind& sampleKind(const std::string& name) {
  std::string known;
  std::vector<std::string> names;
  for (const SampleKind& kind : kKinds) {
    if (name == kind.name) return kind;
    known += (known.empty() ? "" : ", ") + std::string(kind.name);
    names.emplace_back(kind.name);
  }
  throw UsageError("unknown sample '" + name + "'; the samples are " + known +
                   didYouMean(name, names));
}

}  // namespace esvr::samples
