#include "generators/shapes.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace esvr::samples {
namespace {

constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;  // 2^64 / golden ratio, spreads counters

/// Stafford's mixer 13 of the 64-bit finaliser of MurmurHash3.
std::uint64_t mix(std::uint64_t h) {
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
  return h ^ (h >> 31);
}

double unit(std::uint64_t h) { return double(h >> 11) * 0x1p-53; }

/// Odd numbers near 2^64 / p, 2^64 / p^2 and 2^64 / p^3 with p^4 = p + 1. Their multiples fill the
/// range evenly, so that one mixing step suffices for three coordinates.
constexpr std::uint64_t kStrideX = 0xd1b54a32d192ed03u;
constexpr std::uint64_t kStrideY = 0xabc98388fb8fac03u;
constexpr std::uint64_t kStrideZ = 0x8cb92ba72f3d8dd7u;

double latticeValue(std::uint64_t start, std::int64_t x, std::int64_t y, std::int64_t z) {
  const std::uint64_t place =
      std::uint64_t(x) * kStrideX + std::uint64_t(y) * kStrideY + std::uint64_t(z) * kStrideZ;
  return 2.0 * unit(mix(start + place)) - 1.0;
}

/// A weight whose first two derivatives vanish at 0 and 1, so that noise shows no lattice.
double fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

double mixLinear(double a, double b, double t) { return a + (b - a) * t; }

}  // namespace

std::uint64_t hash(std::uint64_t seed, std::uint64_t counter) {
  return mix(mix(seed + kGolden) ^ (counter * kGolden));
}

double Random::uniform() { return unit(hash(seed_, counter_++)); }

Vec3 Random::inCube(double low, double high) {
  const double x = uniform(low, high), y = uniform(low, high), z = uniform(low, high);
  return {x, y, z};
}

Vec3 Random::direction() {
  for (;;) {
    const Vec3 v = inCube(-1.0, 1.0);
    const double square = dot(v, v);
    if (square > 1e-6 && square <= 1.0) return v * (1.0 / std::sqrt(square));
  }
}

double noise(std::uint64_t seed, Vec3 p) {
  const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  const auto x = std::int64_t(fx), y = std::int64_t(fy), z = std::int64_t(fz);
  const double tx = fade(p.x - fx), ty = fade(p.y - fy), tz = fade(p.z - fz);
  const std::uint64_t start = mix(seed + kGolden);
  const auto alongZ = [&](int dx, int dy) {
    return mixLinear(latticeValue(start, x + dx, y + dy, z),
                     latticeValue(start, x + dx, y + dy, z + 1), tz);
  };
  return mixLinear(mixLinear(alongZ(0, 0), alongZ(0, 1), ty),
                   mixLinear(alongZ(1, 0), alongZ(1, 1), ty), tx);
}

double fractalNoise(std::uint64_t seed, Vec3 p, int octaves) {
  double sum = 0.0, weight = 1.0, weights = 0.0;
  for (int octave = 0; octave < octaves; ++octave) {
    sum += weight * noise(seed + std::uint64_t(octave), p);
    weights += weight;
    weight *= 0.5;
    p = p * 2.0;
  }
  return sum / weights;
}

// ---- Shapes

// Blobs.

namespace {

constexpr int kBlobs = 40;
constexpr double kSmallestRadius = 0.06, kLargestRadius = 0.22;  // in sides of the cube

double heightAt(const Blob& blob, Vec3 p) {
  const Vec3 d = p - blob.center;
  const double rest = 1.0 - dot(d, d) / (blob.radius * blob.radius);
  return rest > 0.0 ? blob.height * rest * rest * rest : 0.0;
}

std::vector<Blob> scatterBlobs(const SampleOptions& options) {
  Random random(options.seed);
  std::vector<Blob> blobs;
  for (int i = 0; i < kBlobs; ++i) {
    const double radius = random.uniform(kSmallestRadius, kLargestRadius);
    const Vec3 center = random.inCube(radius, 1.0 - radius);
    const double height = random.uniform(0.2, 1.0);
    // voxel centres lie at 0.5 / resolution, 1.5 / resolution, ...
    blobs.push_back({center * options.resolution - Vec3{0.5, 0.5, 0.5},
                     std::max(radius * options.resolution, 1.0), height});
  }
  return blobs;
}

}  // namespace

BlobShape::BlobShape(std::span<const Blob> blobs, float background)
    : blobs_(blobs), background_(background), near_(blobs.size()) {
  std::iota(near_.begin(), near_.end(), std::uint32_t{0});
}

std::optional<BlobShape> BlobShape::within(const Ball& ball) const {
  BlobShape narrowed(*this);
  std::erase_if(narrowed.near_, [&](std::uint32_t i) {
    return length(blobs_[i].center - ball.center) >= blobs_[i].radius + ball.radius;
  });
  if (narrowed.near_.empty()) return std::nullopt;
  return narrowed;
}

Sample BlobShape::at(Vec3 p) const {
  double sum = 0.0;
  for (const std::uint32_t i : near_) sum += heightAt(blobs_[i], p);
  if (sum < kFaintestBlob) return {background_, false};
  return {float(background_ + sum), true};
}

SparseVolume makeBlobs(const SampleOptions& options, float background) {
  const auto blobs = scatterBlobs(options);
  const int last = options.resolution;  // a blob of one voxel may reach beyond the cube
  return voxelise(BlobShape(blobs, background), {.box = {{-1, -1, -1}, {last, last, last}},
                                                 .background = background,
                                                 .limits = options.limits});
}

// The plume.

namespace {

// All lengths are in units of the plume's height.
constexpr double kFootRadius = 0.05, kWidening = 0.2;
constexpr double kSway = 0.05;                    // amplitude of the axis's deviation
constexpr double kSwaySize = 0.4;                 // size of the axis's bends
constexpr double kBillowSize = 0.12;              // size of the largest eddies
constexpr double kBillowDepth = 1.1;              // depth of eddies, in radii of the envelope
constexpr double kWarpSize = 0.25, kWarp = 0.05;  // size and amplitude of the warp of eddies
// Heights that the eddies, their warp and the bends of the axis rise in a frame.
constexpr double kRise = 0.01, kWarpRise = 0.006, kBendRise = 0.004;
constexpr double kFadeStart = 0.7;              // height at which the top begins to dissolve
constexpr double kSmallestEddy = 4.0;           // voxels
constexpr double kFaintestSmoke = 1.0 / 512.0;  // smallest value of a voxel that is not empty

/// Bound on the slope of (distance to the axis - kBillowDepth * radius of the envelope).
constexpr double kAxisSlope = kSway * (1.0 + kNoiseSlope / kSwaySize);  // along x, and along z
constexpr double kEnvelopeSlope = 1.0 + 2.0 * kAxisSlope + kBillowDepth * kWidening;

int octavesFor(int resolution) {
  int octaves = 1;
  while (kBillowSize * resolution > kSmallestEddy * double(1 << octaves)) ++octaves;
  return octaves;
}

}  // namespace

PlumeShape::PlumeShape(std::uint64_t seed, int resolution, int frame)
    : seed_(seed), resolution_(resolution), octaves_(octavesFor(resolution)), frame_(frame) {}

std::optional<PlumeShape> PlumeShape::within(const Ball& ball) const {
  const Vec3 p = place(ball.center);
  const double radius = ball.radius / resolution_;
  if (p.y + radius < 0.0 || p.y - radius > 1.0) return std::nullopt;
  const double outside = distanceToAxis(p) - kBillowDepth * envelopeRadius(p.y);
  if (outside > kEnvelopeSlope * radius) return std::nullopt;
  return *this;
}

Sample PlumeShape::at(Vec3 voxel) const {
  const Vec3 p = place(voxel);
  if (p.y < 0.0 || p.y > 1.0) return {};
  const double density = densityAt(p);
  if (density < kFaintestSmoke) return {};
  return {float(density), true};
}

Vec3 PlumeShape::place(Vec3 voxel) const {
  return (voxel + Vec3{0.5, 0.5, 0.5}) * (1.0 / resolution_) - Vec3{0.5, 0.0, 0.5};
}

double PlumeShape::envelopeRadius(double y) const {
  const double oneVoxel = 1.0 / resolution_;
  return std::max(kFootRadius + kWidening * std::clamp(y, 0.0, 1.0), oneVoxel);
}

double PlumeShape::distanceToAxis(Vec3 p) const {
  const double height = std::clamp(p.y, 0.0, 1.0);
  const Vec3 along{0.5, before({0.0, height, 0.0}, kBendRise).y / kSwaySize, 0.5};
  const double x = p.x - kSway * height * noise(seed_, along);
  const double z = p.z - kSway * height * noise(seed_ + 1, along);
  return std::sqrt(x * x + z * z);
}

Vec3 PlumeShape::before(Vec3 p, double rise) const { return p - Vec3{0.0, rise * frame_, 0.0}; }

Vec3 PlumeShape::warped(Vec3 p) const {
  const Vec3 q = before(p, kWarpRise) * (1.0 / kWarpSize);
  return p + Vec3{noise(seed_ + 2, q), noise(seed_ + 3, q), noise(seed_ + 4, q)} * kWarp;
}

double PlumeShape::densityAt(Vec3 p) const {
  const double depth = kBillowDepth - distanceToAxis(p) / envelopeRadius(p.y);
  if (depth < kFaintestSmoke) return 0.0;
  const Vec3 eddy = before(warped(p), kRise) * (1.0 / kBillowSize);
  const double billows = fractalNoise(seed_ + 5, eddy, octaves_);
  const double fade = std::min(1.0, (1.0 - p.y) / (1.0 - kFadeStart));
  return std::clamp(depth - kBillowDepth * std::abs(billows), 0.0, 1.0) * fade;
}

SparseVolume makePlume(const SampleOptions& options) {
  const int last = options.resolution - 1;
  return voxelise(
      PlumeShape(options.seed, options.resolution, options.frame),
      {.box = {{0, 0, 0}, {last, last, last}}, .background = 0.0f, .limits = options.limits});
}

// The level set.

namespace {

// Lengths are in units of the resolution, relative to the middle.
constexpr double kRingRadius = 0.33, kRingThickness = 0.1;
constexpr Vec3 kBallCenters[] = {{0.33, 0.0, 0.0}, {-0.2, 0.1, 0.2}};
constexpr double kBallRadius = 0.15;

double distanceToRing(Vec3 p) {
  const double fromCircle = std::sqrt(p.x * p.x + p.z * p.z) - kRingRadius;
  return std::sqrt(fromCircle * fromCircle + p.y * p.y) - kRingThickness;
}

}  // namespace

double LevelSetShape::distance(Vec3 p) const {
  const Vec3 q = (p + Vec3{0.5, 0.5, 0.5}) * (1.0 / resolution_) - Vec3{0.5, 0.5, 0.5};
  double nearest = distanceToRing(q);
  for (const Vec3 center : kBallCenters)
    nearest = std::min(nearest, length(q - center) - kBallRadius);
  return nearest * resolution_;
}

std::optional<LevelSetShape> LevelSetShape::within(const Ball& ball) const {
  if (std::abs(distance(ball.center)) >= ball.radius + kBandVoxels) return std::nullopt;
  return *this;
}

Sample LevelSetShape::at(Vec3 p) const {
  const double d = distance(p);
  const double clamped = std::clamp(d, -kBandVoxels, kBandVoxels);
  return {float(clamped * voxelSize_), std::abs(d) < kBandVoxels};
}

SparseVolume makeLevelSet(const SampleOptions& options, double voxelSize) {
  const auto band = int(kBandVoxels) + 1;
  const int last = options.resolution + band;
  return voxelise(LevelSetShape(options.resolution, voxelSize),
                  {.box = {{-band, -band, -band}, {last, last, last}},
                   .background = float(kBandVoxels * voxelSize),
                   .limits = options.limits});
}

}  // namespace esvr::samples
