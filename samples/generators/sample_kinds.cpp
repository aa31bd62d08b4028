#include "generators/sample_kinds.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "esvr/did_you_mean.h"
#include "esvr/error.h"
#include "generators/shapes.h"
#include "generators/tubes.h"

namespace esvr::samples {
namespace {

// Lengths are in units of the resolution, relative to the middle of the cube.
constexpr double kChunkCenter = 0.25, kChunkHalf = 0.21, kChunkNoiseSize = 0.1;
constexpr double kShellRadius = 0.45, kShellThickness = 0.02;
constexpr double kDiffuseRadius = 0.28, kDiffuseEdge = 0.4;
constexpr double kFaintest = 1.0 / 1024.0;  // smallest value of a voxel that is not empty

Vec3 fromMiddle(Vec3 voxel, int resolution) {
  return (voxel + Vec3{0.5, 0.5, 0.5}) * (1.0 / resolution) - Vec3{0.5, 0.5, 0.5};
}

/// A solid with a soft edge.
/// \tparam Solid  a type with distance(p), the distance to the surface (with a slope of at most 1),
///                and density(p); p is a result of fromMiddle
template <class Solid>
class SoftShape {
 public:
  SoftShape(Solid solid, int resolution, double edge)
      : solid_(solid), resolution_(resolution), edge_(edge) {}

  [[nodiscard]] std::optional<SoftShape> within(const Ball& ball) const {
    if (distance(ball.center) >= ball.radius + edge_ / 2.0) return std::nullopt;
    return *this;
  }
  [[nodiscard]] Sample at(Vec3 voxel) const {
    const double density = solid_.density(fromMiddle(voxel, resolution_));
    const double value = density * double(softEdge(distance(voxel), edge_));
    if (value < kFaintest) return {};
    return {float(value), true};
  }

 private:
  [[nodiscard]] double distance(Vec3 voxel) const {
    return solid_.distance(fromMiddle(voxel, resolution_)) * resolution_;
  }

  Solid solid_;
  int resolution_;
  double edge_;  ///< voxels
};

template <class Solid>
SparseVolume makeSoft(Solid solid, double edge, const SampleOptions& options) {
  const int last = options.resolution;  // a soft edge reaches one voxel beyond the cube
  return voxelise(
      SoftShape<Solid>(solid, options.resolution, edge),
      {.box = {{-1, -1, -1}, {last, last, last}}, .background = 0.0f, .limits = options.limits});
}

struct EightChunks {
  std::uint64_t seed;

  [[nodiscard]] double distance(Vec3 p) const {
    const auto side = [](double c) { return std::abs(std::abs(c) - kChunkCenter) - kChunkHalf; };
    const Vec3 d{side(p.x), side(p.y), side(p.z)};
    const double inside = std::min(std::max({d.x, d.y, d.z}), 0.0);
    return length(maxVec(d, {})) + inside;
  }
  [[nodiscard]] double density(Vec3 p) const {
    const auto octant = std::uint64_t((p.x < 0 ? 4 : 0) + (p.y < 0 ? 2 : 0) + (p.z < 0 ? 1 : 0));
    const double level = 0.3 + 0.05 * double(octant);
    return level + 0.3 * noise(seed + octant, p * (1.0 / kChunkNoiseSize));
  }
};

struct Shell {
  double thickness;
  [[nodiscard]] double distance(Vec3 p) const {
    return std::abs(length(p) - kShellRadius) - thickness / 2.0;
  }
  [[nodiscard]] double density(Vec3) const { return 1.0; }
};

struct DiffuseBall {
  [[nodiscard]] double distance(Vec3 p) const { return length(p) - kDiffuseRadius; }
  [[nodiscard]] double density(Vec3) const { return 1.0; }
};

SparseVolume makeTubes(const std::vector<Tube>& tubes, const SampleOptions& options) {
  return voxeliseTubes(fitTubes(tubes, {.resolution = options.resolution}).tubes, kDefaultEdge,
                       options.limits);
}

/// A tube that winds around the x axis of its own frame from x = -0.5 to 0.5. Each step turns by
/// the angle with cosine 24/25 and sine 7/25, which needs no trigonometric function.
void appendWiggle(std::vector<Tube>& tubes, Vec3 start, double radius) {
  constexpr int kSteps = 66;  // 3 turns
  constexpr double kCos = 24.0 / 25.0, kSin = 7.0 / 25.0, kAmplitude = 0.12, kThickness = 0.018;
  double c = radius, s = 0.0;
  Vec3 at = start + Vec3{-0.5, kAmplitude * c, kAmplitude * s};
  for (int i = 1; i <= kSteps; ++i) {
    const double turned = c * kCos - s * kSin;
    s = c * kSin + s * kCos;
    c = turned;
    const Vec3 next = start + Vec3{double(i) / kSteps - 0.5, kAmplitude * c, kAmplitude * s};
    tubes.push_back({at, next, kThickness, kThickness});
    at = next;
  }
}

}  // namespace

SparseVolume makeEightAreas(const SampleOptions& options) {
  return makeSoft(EightChunks{options.seed}, kDefaultEdge, options);
}

SparseVolume makeEmptySphere(const SampleOptions& options) {
  const double oneVoxel = 1.0 / options.resolution;
  return makeSoft(Shell{std::max(kShellThickness, oneVoxel)}, kDefaultEdge, options);
}

SparseVolume makeDiffuseScalar(const SampleOptions& options) {
  const double edge = std::max(kDiffuseEdge * options.resolution, kDefaultEdge);
  return makeSoft(DiffuseBall{}, edge, options);
}

SparseVolume makeSynthTube(const SampleOptions& options) {
  return makeTubes({{{-0.45, 0.0, 0.0}, {0.45, 0.0, 0.0}, 0.05, 0.05},
                    {{0.0, -0.4, 0.1}, {0.0, 0.4, 0.1}, 0.03, 0.03},
                    {{-0.3, -0.3, -0.4}, {0.3, 0.3, 0.4}, 0.02, 0.02},
                    {{-0.4, 0.3, -0.2}, {0.4, 0.2, 0.3}, 0.04, 0.01}},
                   options);
}

SparseVolume makeSynthWiggle(const SampleOptions& options) {
  std::vector<Tube> tubes;
  appendWiggle(tubes, {0.0, 0.0, 0.0}, 1.0);
  appendWiggle(tubes, {0.0, 0.3, 0.1}, -0.7);
  appendWiggle(tubes, {0.0, -0.25, -0.2}, 0.5);
  return makeTubes(tubes, options);
}

// ---- Kinds of samples

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
