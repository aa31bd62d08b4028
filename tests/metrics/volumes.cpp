#include "metrics/volumes.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "fit/volumes.h"

namespace esvr::test {
namespace {

BrickInput emptyBrick(Coord brick, float background) {
  BrickInput input{.corner = brick * kBrickSide, .values = {}, .active = {}};
  input.values.fill(background);
  return input;
}

class VolumeBuilder {
 public:
  explicit VolumeBuilder(float background) : background_(background) {}

  void set(Coord at, float value) {
    const Coord brick = brickOf(at);
    auto& input = bricks_.try_emplace(brick, emptyBrick(brick, background_)).first->second;
    input.values[std::size_t(voxelOffset(localOf(at)))] = value;
    input.active.set(voxelOffset(localOf(at)));
  }
  SparseVolume finish() const {
    std::vector<BrickInput> bricks;
    for (const auto& [brick, input] : bricks_) bricks.push_back(input);
    return makeVolume(std::move(bricks), background_);
  }

 private:
  float background_;
  std::map<Coord, BrickInput> bricks_;
};

BrickInput randomBrick(Coord brick, std::uint64_t seed, const RandomVolumeOptions& options) {
  BrickInput input = emptyBrick(brick, options.background);
  for (int i = 0; i < kBrickVoxels; ++i) {
    const double fate = hashUnit(seed, std::uint64_t(3 * i));
    const auto value = float(2.0 * hashUnit(seed, std::uint64_t(3 * i + 1)) - 0.5);
    if (fate < options.activeShare) input.active.set(i);
    // Some inactive voxels have their own values, as inside a level set.
    const bool keepsValue = fate < options.activeShare + 0.1;
    if (keepsValue) input.values[std::size_t(i)] = value;
  }
  return input;
}

}  // namespace

double hashUnit(std::uint64_t seed, std::uint64_t index) {
  std::uint64_t h = seed * 0x9e3779b97f4a7c15u + index * 0xd1342543de82ef95u + 0x2545f4914f6cdd1du;
  h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
  h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
  return double((h ^ (h >> 32)) >> 11) * 0x1p-53;
}

SparseVolume volumeOf(const std::vector<Voxel>& voxels, float background) {
  VolumeBuilder builder(background);
  for (const Voxel& voxel : voxels) builder.set(voxel.at, voxel.value);
  return builder.finish();
}

SparseVolume volumeOf(const Box& box, const std::function<float(Coord)>& value, float background) {
  VolumeBuilder builder(background);
  forEachVoxel(box, [&](Coord voxel) { builder.set(voxel, value(voxel)); });
  return builder.finish();
}

SparseVolume randomVolume(const RandomVolumeOptions& options) {
  std::vector<BrickInput> bricks;
  const int r = options.brickRange;
  std::uint64_t place = 0;
  for (int x = -r; x < r; ++x)
    for (int y = -r; y < r; ++y)
      for (int z = -r; z < r; ++z, ++place)
        if (hashUnit(options.seed, place) < options.brickShare)
          bricks.push_back(randomBrick({x, y, z}, options.seed * 1000003 + place, options));
  return makeVolume(std::move(bricks), options.background);
}

SparseVolume movedBy(SparseVolume volume, Coord by) {
  volume.origin = volume.origin + by;
  return volume;
}

// The metrics by their definitions.

namespace {

bool isActive(const SparseVolume& volume, Coord voxel) {
  const Coord relative = voxel - volume.origin;
  const auto b = findBrick(volume, brickOf(relative));
  return b && volume.active[*b].test(voxelOffset(localOf(relative)));
}

double errorAt(const SparseVolume& a, const SparseVolume& b, Coord voxel) {
  return std::abs(double(valueAt(a, voxel)) - double(valueAt(b, voxel)));
}

void sumOverBox(VolumeMetrics& m, const SparseVolume& a, const SparseVolume& b, const Box& box) {
  double squared = 0.0;
  m.maxError = -1.0;
  forEachVoxel(box, [&](Coord v) {
    const double error = errorAt(a, b, v);
    squared += error * error;
    m.massReference += double(valueAt(a, v)) - a.background;
    m.massCandidate += double(valueAt(b, v)) - b.background;
    m.maxError = std::max(m.maxError, error);
  });
  m.boxVoxels = box.volume();
  m.mseBox = squared / m.boxVoxels;
}

void sumOverActive(VolumeMetrics& m, const SparseVolume& a, const SparseVolume& b,
                   const Box& everywhere) {
  double squared = 0.0;
  std::size_t both = 0;
  std::vector<double> errors;
  forEachVoxel(everywhere, [&](Coord v) {
    const bool inA = isActive(a, v), inB = isActive(b, v);
    const double error = errorAt(a, b, v);
    if (inA) squared += error * error;
    if (inA) ++m.activeVoxels;
    if (inA && inB) ++both;
    if (inA || inB) errors.push_back(error);
  });
  std::sort(errors.begin(), errors.end());
  const auto rank = std::size_t(std::ceil(0.999L * static_cast<long double>(errors.size())));
  m.p999Error = errors.at(rank - 1);
  m.mseActive = squared / double(m.activeVoxels);
  m.iou = double(both) / double(errors.size());
}

double gaussian(int distance) { return std::exp(-distance * distance / (2.0 * 1.5 * 1.5)); }

/// SSIM at one voxel. The weights are normalised over the part of the 11^3 window inside the box.
double ssimAt(const SparseVolume& a, const SparseVolume& b, const Box& box, double peak, Coord at) {
  const Coord radius{5, 5, 5};
  const Box window{maxCoord(at - radius, box.min), minCoord(at + radius, box.max)};
  double weights = 0.0, meanA = 0.0, meanB = 0.0;
  const auto weightOf = [&](Coord v) {
    return gaussian(v.x - at.x) * gaussian(v.y - at.y) * gaussian(v.z - at.z);
  };
  forEachVoxel(window, [&](Coord v) {
    weights += weightOf(v);
    meanA += weightOf(v) * valueAt(a, v);
    meanB += weightOf(v) * valueAt(b, v);
  });
  meanA /= weights;
  meanB /= weights;
  double varA = 0.0, varB = 0.0, covariance = 0.0;
  forEachVoxel(window, [&](Coord v) {
    const double w = weightOf(v) / weights;
    const double da = valueAt(a, v) - meanA, db = valueAt(b, v) - meanB;
    varA += w * da * da;
    varB += w * db * db;
    covariance += w * da * db;
  });
  const double c1 = std::pow(0.01 * peak, 2), c2 = std::pow(0.03 * peak, 2);
  return (2 * meanA * meanB + c1) * (2 * covariance + c2) /
         ((meanA * meanA + meanB * meanB + c1) * (varA + varB + c2));
}

}  // namespace

VolumeMetrics denseMetrics(const SparseVolume& reference, const SparseVolume& candidate,
                           const Box& box, const Box& everywhere, double peak) {
  VolumeMetrics m;
  m.peak = peak;
  sumOverBox(m, reference, candidate, box);
  sumOverActive(m, reference, candidate, everywhere);
  m.psnrBox = 10.0 * std::log10(peak * peak / m.mseBox);
  m.psnrActive = 10.0 * std::log10(peak * peak / m.mseActive);
  return m;
}

double denseSsim(const SparseVolume& reference, const SparseVolume& candidate, const Box& box,
                 double peak) {
  double sum = 0.0;
  forEachVoxel(box, [&](Coord v) { sum += ssimAt(reference, candidate, box, peak, v); });
  return sum / box.volume();
}

}  // namespace esvr::test
