#include "generators/paper_volumes.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "generators/hash_noise.h"
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

}  // namespace esvr::samples
