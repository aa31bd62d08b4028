// From splats to grids: the density of splats as a sum of Gaussians, which is evaluated like any sum of ellipsoids,
// and their mean color.

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "core/counted.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/splats.h"
#include "splats/gaussian.h"

namespace esvr {
namespace {

using namespace splats;

/// The map from the space of a file to voxels.
struct ToVoxels {
  Quaternion turn;
  double scale;  ///< voxels for a unit of the file
  Matrix3 linear;
  std::array<double, 3> shift;

  ToVoxels(const std::array<double, 16>& toWorld, double voxelSize) {
    const auto& m = toWorld;
    const double perUnit = std::sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    Matrix3 rotation{};
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) {
        rotation[3 * r + c] = m[4 * c + r] / perUnit;
        linear[3 * r + c] = m[4 * c + r] / voxelSize;
      }
      shift[r] = m[12 + r] / voxelSize;
    }
    turn = quaternionOf(rotation);
    scale = perUnit / voxelSize;
  }

  [[nodiscard]] std::array<double, 3> operator()(const Splats& splats, std::size_t i) const {
    std::array<double, 3> place = shift;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        place[r] += linear[3 * r + c] * double(splats.center[c][i]);
    return place;
  }
};

/// The middle value of those from the first to the last share.
double quantile(std::vector<double>& values, double share) {
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double usualVoxelSize(const SplatScene& scene) {
  constexpr double kVoxels = 256.0, kOutliers = 0.01, kDeviations = 6.0;
  const Splats& splats = scene.splats;
  const ToVoxels toWorld(scene.toWorld, 1.0);
  std::array<std::vector<double>, 3> places;
  std::vector<double> sizes;
  for (std::size_t i = 0; i < splats.size(); ++i) {
    const auto place = toWorld(splats, i);
    for (std::size_t a = 0; a < 3; ++a) places[a].push_back(place[a]);
    const float largest =
        std::max({splats.logScale[0][i], splats.logScale[1][i], splats.logScale[2][i]});
    sizes.push_back(toWorld.scale * std::exp(double(largest)));
  }
  double side = kDeviations * quantile(sizes, 0.5);
  for (auto& axis : places)
    side = std::max(side, quantile(axis, 1.0 - kOutliers) - quantile(axis, kOutliers));
  return side / kVoxels;
}

/// The density as a sum of Gaussians at the voxels of one size.
class SplatDensity {
 public:
  SplatDensity(const SplatScene& scene, double voxelSize, double densityScale)
      : splats_(scene.splats),
        toVoxels_(scene.toWorld, voxelSize),
        perDepth_(2.0 * std::numbers::pi / (gaussianVolume() * voxelSize * densityScale)) {}

  /// \param maxBytes  memory for the voxels \throws BadInput  a splat alone needs more
  Field field(std::uint64_t maxBytes, std::uint64_t& thickened) {
    std::map<Coord, Ellipsoids> chunks;
    for (std::size_t i = 0; i < splats_.size(); ++i) {
      if (i % kBetweenChecks == 0) throwIfCancelled();
      const auto place = toVoxels_(splats_, i);
      const Sizes sizes = sizesOf(i, thickened);
      requireReasonable(i, place, sizes, maxBytes);
      const Coord chunk = chunkAt(place);
      append(i, place, chunk, sizes, chunks[chunk]);
      order_[chunk].push_back(i);
    }
    Field field;
    field.kernel = gaussianKernel();
    for (auto& [origin, ellipsoids] : chunks)
      field.chunks.push_back({origin, std::move(ellipsoids)});
    return field;
  }

  /// The smallest and the largest value of a channel of the colors.
  [[nodiscard]] ValueRange colorRange(std::size_t channel) const {
    const auto found = std::ranges::minmax(splats_.color[channel]);
    return {found.min, found.max};
  }

  /// The same with the amplitudes times a channel of the colors.
  [[nodiscard]] Field timesColor(Field field, std::size_t channel) const {
    for (Chunk& chunk : field.chunks) {
      const auto& order = order_.at(chunk.origin);
      for (std::size_t e = 0; e < order.size(); ++e)
        chunk.ellipsoids.intensity[e] *= splats_.color[channel][order[e]];
    }
    return field;
  }

 private:
  static constexpr std::size_t kBetweenChecks = 4096;
  static constexpr double kDensest =
      1e30;  // sums of as many splats as there may be stay in float32

  Sizes sizesOf(std::size_t i, std::uint64_t& thickened) const {
    Sizes sizes;
    for (std::size_t a = 0; a < 3; ++a)
      sizes[a] = toVoxels_.scale * std::exp(double(splats_.logScale[a][i]));
    thickened += std::min({sizes[0], sizes[1], sizes[2]}) < kThinnest;
    return sizes;
  }

  /// A splat so large that it alone fills the memory is a fault of the file or of the voxel size.
  static void requireReasonable(std::size_t i, const std::array<double, 3>& place,
                                const Sizes& sizes, std::uint64_t maxBytes) {
    constexpr double kFarthest = 0x1p30, kBytesPerVoxel = 4.0, kReach = 4.3;
    const double reach = kReach * *std::max_element(sizes.begin(), sizes.end());
    const bool isNear = std::all_of(place.begin(), place.end(),
                                    [&](double p) { return std::abs(p) + reach < kFarthest; });
    double voxels = 4.0 / 3.0 * std::numbers::pi;
    for (const double size : sizes) voxels *= std::max(kReach * size, 1.0);
    if (isNear && voxels * kBytesPerVoxel <= double(maxBytes)) return;
    throw BadInput(
        "splat " + std::to_string(i) + " reaches " +
        (isNear ? "more voxels than there is memory for" : "beyond the index space of a grid") +
        "; the voxels are too small, or the splat is a stray one");
  }

  static Coord chunkAt(const std::array<double, 3>& place) {
    const auto along = [](double x) {
      return std::int32_t(std::floor(x / kChunkExtent)) * kChunkExtent;
    };
    return {along(place[0]), along(place[1]), along(place[2])};
  }

  void append(std::size_t i, const std::array<double, 3>& place, Coord chunk, const Sizes& sizes,
              Ellipsoids& to) const {
    const Quaternion own{splats_.rotation[0][i], splats_.rotation[1][i], splats_.rotation[2][i],
                         splats_.rotation[3][i]};
    const Quaternion rotation = normalised(product(toVoxels_.turn, own));
    const double origin[3] = {double(chunk.x), double(chunk.y), double(chunk.z)};
    double amplitude = perDepth_ * meanShadow(sizes) * depthOfAlpha(double(splats_.alpha[i]));
    for (std::size_t a = 0; a < 3; ++a) {
      const double size = std::max(sizes[a], kThinnest);
      amplitude /= size;
      to.center[a].push_back(float(place[a] - origin[a]));
      to.logScale[a].push_back(float(std::log(size * std::numbers::sqrt2)));
    }
    for (std::size_t a = 0; a < 4; ++a) to.rotation[a].push_back(float(rotation[a]));
    if (!(amplitude < kDensest))
      throw BadInput("the density of splat " + std::to_string(i) +
                     " is too large; the density scale is too small");
    to.intensity.push_back(float(amplitude));
  }

  const Splats& splats_;
  ToVoxels toVoxels_;
  double perDepth_;  ///< amplitude for a depth of 1 over the shadow, times the product of the sizes
  std::map<Coord, std::vector<std::size_t>> order_;  ///< the splats of each chunk
};

double positive(const std::optional<double>& given, double usual, const char* what) {
  const double value = given.value_or(usual);
  if (!(value > 0.0 && std::isfinite(value)))
    throw UsageError(std::string(what) + " must be above 0");
  return value;
}

void describe(const std::string& name, GridClass gridClass, double voxelSize,
              GridDescriptor& descriptor) {
  descriptor.name = name;
  descriptor.gridClass = gridClass;
  descriptor.transform = uniformTransform(voxelSize);
}

/// The colors of the active voxels of a density.
VectorGrid colorsOf(const SplatDensity& density, const Field& field, const VolumeGrid& grid,
                    double voxelSize, const VoxelMemory& memory) {
  VectorGrid colors;
  describe("Cd", GridClass::kUnknown, voxelSize, colors.descriptor);
  const std::vector<Coord> corners = brickCorners(grid.volume);
  for (std::size_t channel = 0; channel < kComponents; ++channel) {
    SparseVolume& volume = colors.components[channel];
    volume = revoxelise(density.timesColor(field, channel), {.bricks = corners,
                                                             .restrictToBricks = true,
                                                             .masks = grid.volume.active,
                                                             .memory = memory});
    const ValueRange range = density.colorRange(channel);
    parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
      const auto sums = volume.brickValues(b);
      const auto weights = grid.volume.brickValues(b);
      // A mean is within its range, whatever the sums are rounded to.
      forEachActive(volume.active[b], [&](int v) {
        sums[std::size_t(v)] =
            std::clamp(sums[std::size_t(v)] / weights[std::size_t(v)], range.min, range.max);
      });
    });
  }
  return colors;
}

}  // namespace

SplatGrids makeSplatGrids(const SplatScene& scene, const SplatGridOptions& options) {
  constexpr double kFaintest = 1e-5;  // optical depth of an active voxel
  SplatGrids grids;
  const double size = positive(options.voxelSize, usualVoxelSize(scene), "the voxel size");
  const double densityScale =
      positive(options.densityScale, scene.densityScale, "the density scale");
  grids.voxelSize = size;
  SplatDensity density(scene, size, densityScale);
  const Field field = density.field(options.maxBytes, grids.thickened);
  const double volumes = scene.splats.hasColors() ? 1.0 + kComponents : 1.0;
  const WorkEstimate work =
      estimateWork(field, {.enough = double(options.maxBytes) / volumes, .memory = options.memory});
  requireWithinMemory(volumes * work.bytes(options.memory), options.maxBytes,
                      "the grids of splats with a voxel size of " + shortText(size));
  describe("density", GridClass::kFogVolume, size, grids.density.descriptor);
  grids.density.volume = revoxelise(
      field, {.threshold = float(kFaintest / (size * densityScale)), .memory = options.memory});
  if (activeVoxelCount(grids.density.volume) == 0)
    throw BadInput("its splats are too faint for any active voxel of the size " + shortText(size));
  if (scene.splats.hasColors())
    grids.color = colorsOf(density, field, grids.density, size, options.memory);
  return grids;
}

}  // namespace esvr
