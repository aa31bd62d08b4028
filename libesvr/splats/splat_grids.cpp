// From splats to grids: the density of splats as a sum of Gaussians, which is evaluated like any sum of ellipsoids,
// and their mean color.

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "core/counted.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/splats.h"
#include "field/line_form.h"
#include "splats/gaussian.h"

namespace esvr {
namespace {

using namespace splats;

using Affine = std::array<double, 16>;  ///< a map of row vectors, as Transform::affine

/// The map from the index space of voxels to the world.
struct VoxelLattice {
  Affine toWorld{};

  /// Cubes with the center of the first one at the origin.
  static VoxelLattice ofCubes(double size) {
    return {{size, 0, 0, 0, 0, size, 0, 0, 0, 0, size, 0, 0, 0, 0, 1}};
  }

  [[nodiscard]] double shortestEdge() const {
    double shortest = std::numeric_limits<double>::infinity();
    for (std::size_t row = 0; row < 3; ++row)
      shortest = std::min(shortest,
                          std::hypot(toWorld[4 * row], toWorld[4 * row + 1], toWorld[4 * row + 2]));
    return shortest;
  }

  /// Voxels whose shortest edge has a length, and whose corner at the first voxel stays where it is (transformAt in
  /// resolution.h, without its limits).
  [[nodiscard]] VoxelLattice withEdge(double size) const {
    // A size that a user types need not be a double of its multiple.
    constexpr double kRounding = 1e-6;
    double factor = size / shortestEdge();
    if (std::abs(factor - std::round(factor)) < kRounding * factor) factor = std::round(factor);
    if (factor == 1.0) return *this;
    VoxelLattice other = *this;
    for (std::size_t column = 0; column < 3; ++column)
      for (std::size_t row = 0; row < 3; ++row) {
        other.toWorld[12 + column] += 0.5 * (factor - 1.0) * toWorld[4 * row + column];
        other.toWorld[4 * row + column] *= factor;
      }
    return other;
  }
};

/// The map from the space of a file to voxels.
struct ToVoxels {
  Matrix3 linear{};  ///< a map of columns
  std::array<double, 3> shift{};
  double perUnit;      ///< units of the world for a unit of the file
  double voxelVolume;  ///< volume of a voxel in the world

  ToVoxels(const Affine& m, const VoxelLattice& lattice)
      : perUnit(std::sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2])) {
    const Affine& g = lattice.toWorld;
    const Matrix3 edges{g[0], g[4], g[8], g[1], g[5], g[9], g[2], g[6], g[10]};
    const Matrix3 toIndex = esvr::inverse(edges);
    voxelVolume =
        std::abs(g[0] * (g[5] * g[10] - g[6] * g[9]) - g[1] * (g[4] * g[10] - g[6] * g[8]) +
                 g[2] * (g[4] * g[9] - g[5] * g[8]));
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t c = 0; c < 3; ++c) linear[3 * r + c] += toIndex[3 * r + k] * m[4 * c + k];
        shift[r] += toIndex[3 * r + k] * (m[12 + k] - g[12 + k]);
      }
  }

  [[nodiscard]] std::array<double, 3> operator()(const Splats& splats, std::size_t i) const {
    std::array<double, 3> place = shift;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        place[r] += linear[3 * r + c] * double(splats.center[c][i]);
    return place;
  }

  /// The shape among voxels of a splat with these sizes in the file.
  [[nodiscard]] PrincipalGaussian shapeOf(const Splats& splats, std::size_t i,
                                          const Sizes& sizes) const {
    const Matrix3 axes = rotationOf(normalised({splats.rotation[0][i], splats.rotation[1][i],
                                                splats.rotation[2][i], splats.rotation[3][i]}));
    Matrix3 columns{};
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < 3; ++k)
          columns[3 * r + c] += linear[3 * r + k] * axes[3 * k + c] * sizes[c];
    return principalAxesOf(columns);
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
  const ToVoxels toWorld(scene.toWorld, VoxelLattice::ofCubes(1.0));
  std::array<std::vector<double>, 3> places;
  std::vector<double> sizes;
  for (std::size_t i = 0; i < splats.size(); ++i) {
    const auto place = toWorld(splats, i);
    for (std::size_t a = 0; a < 3; ++a) places[a].push_back(place[a]);
    const float largest =
        std::max({splats.logScale[0][i], splats.logScale[1][i], splats.logScale[2][i]});
    sizes.push_back(toWorld.perUnit * std::exp(double(largest)));
  }
  double side = kDeviations * quantile(sizes, 0.5);
  for (auto& axis : places)
    side = std::max(side, quantile(axis, 1.0 - kOutliers) - quantile(axis, kOutliers));
  return side / kVoxels;
}

VoxelLattice latticeFor(const SplatScene& scene, const std::optional<double>& voxelSize) {
  if (voxelSize && !(*voxelSize > 0.0 && std::isfinite(*voxelSize)))
    throw UsageError("the voxel size must be above 0");
  if (!scene.indexToWorld)
    return VoxelLattice::ofCubes(voxelSize ? *voxelSize : usualVoxelSize(scene));
  const VoxelLattice ofGrid{*scene.indexToWorld};
  return voxelSize ? ofGrid.withEdge(*voxelSize) : ofGrid;
}

/// The density as a sum of Gaussians at the voxels of a lattice.
class SplatDensity {
 public:
  SplatDensity(const SplatScene& scene, const VoxelLattice& lattice, double densityScale)
      : splats_(scene.splats),
        isWidened_(scene.indexToWorld.has_value()),
        toVoxels_(scene.toWorld, lattice),
        perDepth_(2.0 * std::numbers::pi * toVoxels_.perUnit * toVoxels_.perUnit /
                  (gaussianVolume() * toVoxels_.voxelVolume * densityScale)) {}

  /// \param maxBytes  memory for the voxels \throws BadInput  a splat alone needs more
  Field field(std::uint64_t maxBytes, std::uint64_t& thickened) {
    std::map<Coord, Ellipsoids> chunks;
    for (std::size_t i = 0; i < splats_.size(); ++i) {
      if (i % kBetweenChecks == 0) throwIfCancelled();
      const auto place = toVoxels_(splats_, i);
      const Sizes inFile = sizesInFile(i);
      const PrincipalGaussian shape = toVoxels_.shapeOf(splats_, i, ownSizes(i, inFile));
      thickened += shape.sizes[2] < kThinnest;
      requireReasonable(i, place, shape.sizes, maxBytes);
      const Coord chunk = chunkAt(place);
      append(i, {place, shape, depthOf(i, inFile)}, chunk, chunks[chunk]);
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

  /// A Gaussian of the density among voxels.
  struct Placed {
    std::array<double, 3> place;
    PrincipalGaussian shape;
    double integral;  ///< over space in units of voxels
  };

  [[nodiscard]] Sizes sizesInFile(std::size_t i) const {
    Sizes sizes;
    for (std::size_t a = 0; a < 3; ++a) sizes[a] = std::exp(double(splats_.logScale[a][i]));
    return sizes;
  }

  /// The sizes of the Gaussian from which makeSplats() made a splat, up to the rounding of its alpha.
  [[nodiscard]] Sizes ownSizes(std::size_t i, Sizes sizes) const {
    if (!isWidened_) return sizes;
    const double alpha = std::round(kAlphaSteps * double(splats_.alpha[i])) / kAlphaSteps;
    if (!(alpha > 0.0 && alpha < 1.0)) return sizes;
    for (double& size : sizes) size /= widening(-std::log1p(-alpha), alpha);
    return sizes;
  }

  /// The integral of the density of a splat over the voxels, divided by that of a Gaussian of the height and the sizes 1.
  [[nodiscard]] double depthOf(std::size_t i, const Sizes& inFile) const {
    return perDepth_ * meanShadow(inFile) * depthOfAlpha(double(splats_.alpha[i]));
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

  void append(std::size_t i, const Placed& splat, Coord chunk, Ellipsoids& to) const {
    const double origin[3] = {double(chunk.x), double(chunk.y), double(chunk.z)};
    double amplitude = splat.integral;
    for (std::size_t a = 0; a < 3; ++a) {
      const double size = std::max(splat.shape.sizes[a], kThinnest);
      amplitude /= size;
      to.center[a].push_back(float(splat.place[a] - origin[a]));
      to.logScale[a].push_back(float(std::log(size * std::numbers::sqrt2)));
    }
    for (std::size_t a = 0; a < 4; ++a) to.rotation[a].push_back(float(splat.shape.rotation[a]));
    if (!(amplitude < kDensest))
      throw BadInput("the density of splat " + std::to_string(i) +
                     " is too large; the density scale is too small");
    to.intensity.push_back(float(amplitude));
  }

  const Splats& splats_;
  bool isWidened_;  ///< makeSplats() made them
  ToVoxels toVoxels_;
  /// Amplitude for a depth of 1 over the shadow in the file, times the product of the sizes.
  double perDepth_;
  std::map<Coord, std::vector<std::size_t>> order_;  ///< the splats of each chunk
};

void describe(const std::string& name, GridClass gridClass, const Transform& transform,
              GridDescriptor& descriptor) {
  descriptor.name = name;
  descriptor.gridClass = gridClass;
  descriptor.transform = transform;
}

/// The colors of the active voxels of a density.
VectorGrid colorsOf(const SplatDensity& density, const Field& field, const VolumeGrid& grid,
                    const VoxelMemory& memory) {
  VectorGrid colors;
  describe("Cd", GridClass::kUnknown, grid.descriptor.transform, colors.descriptor);
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
  const VoxelLattice lattice = latticeFor(scene, options.voxelSize);
  const double size = lattice.shortestEdge();
  const double densityScale = options.densityScale.value_or(scene.densityScale);
  if (!(densityScale > 0.0 && std::isfinite(densityScale)))
    throw UsageError("the density scale must be above 0");
  grids.voxelSize = size;
  SplatDensity density(scene, lattice, densityScale);
  const Field field = density.field(options.maxBytes, grids.thickened);
  const double volumes = scene.splats.hasColors() ? 1.0 + kComponents : 1.0;
  const WorkEstimate work =
      estimateWork(field, {.enough = double(options.maxBytes) / volumes, .memory = options.memory});
  requireWithinMemory(volumes * work.bytes(options.memory), options.maxBytes,
                      "the grids of splats with a voxel size of " + shortText(size));
  describe("density", GridClass::kFogVolume,
           scene.indexToWorld ? affineTransform(lattice.toWorld) : uniformTransform(size),
           grids.density.descriptor);
  grids.density.volume = revoxelise(
      field, {.threshold = float(kFaintest / (size * densityScale)), .memory = options.memory});
  if (activeVoxelCount(grids.density.volume) == 0)
    throw BadInput("its splats are too faint for any active voxel of the size " + shortText(size));
  if (scene.splats.hasColors())
    grids.color = colorsOf(density, field, grids.density, options.memory);
  return grids;
}

}  // namespace esvr
