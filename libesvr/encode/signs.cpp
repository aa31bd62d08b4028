// The signs of a narrow band. No voxel of a level set may change its side of the surface: ellipsoids get
// a residual of voxels where the sum has the wrong sign, and every stored band is checked.

#include "encode/signs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/counted.h"
#include "core/parallel.h"
#include "encode/ellipsoids.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "field/evaluate.h"

// ---- The residual

namespace esvr::encode {
namespace {

/// Largest difference of evaluateBricks between two machines, as a share of the sum of |I|: twice
/// the error that field.h states, for aspect ratios up to 100 and up to 1000.
constexpr double kDifference = 2.0 * 4e-6, kDifferenceStretched = 2.0 * 2e-4;
constexpr double kStretchedLog = 4.6;  // natural logarithm of an aspect ratio of 100

/// Steps of the residual's lattice in the half width of a band, which is usually 3 voxels. A voxel
/// that is corrected then has an error of at most a twentieth of a voxel.
constexpr double kStepsOfHalfWidth = 64.0;
/// Margins that a step has at least, so that every voxel has a code.
constexpr double kMarginsOfStep = 8.0;

/// The codes of a residual in one brick.
struct BrickCodes {
  Coord corner;  ///< index coordinates of the brick's first voxel
  std::array<std::int32_t, kBrickVoxels> codes{};
};

/// The largest difference between two machines' evaluations of each brick.
/// \param corners  index corners of the bricks
std::vector<double> marginsOf(const Field& field, std::span<const Coord> corners) {
  std::vector<double> differences;
  for (const Chunk& chunk : field.chunks) {
    const Ellipsoids& e = chunk.ellipsoids;
    for (std::size_t i = 0; i < e.size(); ++i) {
      const auto [low, high] = std::minmax({e.logScale[0][i], e.logScale[1][i], e.logScale[2][i]});
      differences.push_back(std::abs(double(e.intensity[i])) *
                            (high - low < kStretchedLog ? kDifference : kDifferenceStretched));
    }
  }
  const BrickPairs pairs = planEvaluation(field, corners).pairs;
  std::vector<double> margins(corners.size(), kDifference * std::abs(double(field.background)));
  for (std::size_t b = 0; b < corners.size(); ++b)
    for (std::uint32_t p = pairs.brickBegin[b]; p < pairs.brickBegin[b + 1]; ++p)
      margins[b] += differences[pairs.ellipsoid[p]];
  return margins;
}

/// The sum in the bricks of a grid, with all voxels active.
SparseVolume sumWithin(const StoredGrid& grid) {
  return revoxelise(grid.field, {.threshold = -std::numeric_limits<float>::max(),
                                 .range = voxelRule(grid).range,
                                 .bricks = grid.bricks,
                                 .restrictToBricks = true});
}

/// True if a value has the wanted sign on every machine.
bool hasSign(double value, bool inside, double margin) {
  return inside ? value < -margin : value >= margin;
}

/// The code that brings a voxel nearest to its value in the source with the sign of the source; 0 if
/// the sum has this sign.
std::int32_t codeFor(float wanted, float sum, double step, double margin) {
  const bool inside = wanted < 0.0f;
  if (hasSign(sum, inside, margin)) return 0;
  auto code = std::int32_t(std::lround((double(wanted) - sum) / step));
  // The margin counts twice, which leaves room for the rounding of the value to float32.
  while (!hasSign(double(sum) + code * step, inside, 2.0 * margin)) code += inside ? -1 : 1;
  return code;
}

BrickCodes codesOf(std::span<const float> wanted, std::span<const float> sum, double step,
                   double margin) {
  BrickCodes brick;
  for (std::size_t v = 0; v < kBrickVoxels; ++v)
    brick.codes[v] = codeFor(wanted[v], sum[v], step, margin);
  return brick;
}

bool isEmpty(const BrickCodes& brick) {
  return std::all_of(brick.codes.begin(), brick.codes.end(), [](auto code) { return code == 0; });
}

/// The layer of a residual. \param bricks  by increasing corners; there is one at least
VoxelLayer layerOf(const std::vector<BrickCodes>& bricks, double divisor) {
  VoxelLayer layer;
  layer.form = VoxelForm::kQuantised;
  layer.divisor = divisor;
  layer.origin = bricks.front().corner;
  for (const BrickCodes& brick : bricks) layer.origin = minCoord(layer.origin, brick.corner);
  for (const BrickCodes& brick : bricks) {
    layer.bricks.push_back(brickOf(brick.corner - layer.origin));
    layer.codes.insert(layer.codes.end(), brick.codes.begin(), brick.codes.end());
  }
  layer.active.resize(bricks.size());
  layer.vacant.resize(bricks.size());
  for (BrickMask& mask : layer.active) mask.setAll();
  return layer;
}

}  // namespace

StoredGrid withSigns(StoredGrid grid, const SparseVolume& source) {
  const auto margins = marginsOf(grid.field, grid.bricks);
  const double margin = margins.empty() ? 0.0 : *std::max_element(margins.begin(), margins.end());
  const double step =
      std::max(double(source.background) / kStepsOfHalfWidth, kMarginsOfStep * margin);
  const SparseVolume sum = sumWithin(grid);
  std::vector<BrickCodes> bricks;
  for (std::size_t b = 0; b < source.brickCount(); ++b) {
    throwIfCancelled();
    BrickCodes brick = codesOf(source.brickValues(b), sum.brickValues(b), step, margins[b]);
    brick.corner = source.brickCorner(b);
    if (!isEmpty(brick)) bricks.push_back(brick);
  }
  if (!bricks.empty()) grid.residual = layerOf(bricks, 1.0 / step);
  return grid;
}

StoredGrid completedWithSigns(StoredGrid grid, const SparseVolume& source) {
  if (auto made = unlessCancelled([&] { return std::optional(withSigns(grid, source)); }))
    return std::move(*made);
  const BestSoFar completion;  // without these signs, the ellipsoids of a band are of no use
  return withSigns(std::move(grid), source);
}

// ---- Converting a band

namespace {

Conversion corrected(const Job& job, Conversion conversion) {
  // The ellipsoids of a size have their residual.
  if (!conversion.grid.voxels && !conversion.grid.residual)
    conversion.grid = completedWithSigns(std::move(conversion.grid), job.input.source);
  return conversion;
}

Conversion bandAsVoxels(const Job& job, const ConvertTo& convertTo) {
  ConvertOptions options = job.options;
  options.representation = Representation::kVoxels;
  return convertTo({job.input, options});
}

/// True if the goal is a quality that voxels may have instead. Of a size, the better ones have been chosen.
bool mayStoreVoxels(const Job& job) {
  return job.options.representation == Representation::kAuto &&
         job.options.storage.form == Storage::kCompact &&
         !std::holds_alternative<FitGoal>(job.options.goal) &&
         !std::holds_alternative<SizeGoal>(job.options.goal);
}

/// True if the voxels that were compared with the ellipsoids take fewer bytes than these and their
/// residual together.
bool voxelsAreSmaller(const Job& job, const Conversion& made) {
  return made.grid.residual && mayStoreVoxels(job) && made.choice && made.choice->voxels &&
         made.choice->voxels->bytes <= bytesAdded(made.grid);
}

/// A voxel in a brick or in one of the next ones along the axes, if it is active.
std::optional<float> activeValueAt(const SparseVolume& volume, std::size_t brick, Coord local) {
  const Coord step{local.x / kBrickSide, local.y / kBrickSide, local.z / kBrickSide};
  if (step != Coord{}) {
    const auto next = findBrick(volume, volume.bricks[brick] + step);
    if (!next) return std::nullopt;
    brick = *next;
    local = local - Coord{kBrickSide * step.x, kBrickSide * step.y, kBrickSide * step.z};
  }
  const int voxel = voxelOffset(local);
  if (!volume.active[brick].test(voxel)) return std::nullopt;
  return volume.brickValues(brick)[std::size_t(voxel)];
}

}  // namespace

std::optional<double> changeAcrossSurface(const SparseVolume& volume) {
  constexpr std::array kSteps{Coord{1, 0, 0}, Coord{0, 1, 0}, Coord{0, 0, 1}};
  std::vector<double> changes;
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (!volume.active[b].test(v)) continue;
      const float value = volume.brickValues(b)[std::size_t(v)];
      for (const Coord step : kSteps)
        if (const auto next = activeValueAt(volume, b, voxelLocal(v) + step))
          if ((value < 0.0f) != (*next < 0.0f)) changes.push_back(std::abs(double(*next) - value));
    }
  if (changes.empty()) return std::nullopt;
  const auto middle = changes.begin() + std::ptrdiff_t(changes.size() / 2);
  std::nth_element(changes.begin(), middle, changes.end());
  return *middle;
}

Conversion convertNarrowBand(const Job& job, const ConvertTo& convertTo) {
  Conversion made = corrected(job, convertTo(job));
  auto smaller = unlessCancelled([&]() -> std::optional<Conversion> {
    if (isCancelled(job) || !voxelsAreSmaller(job, made)) return std::nullopt;
    return bandAsVoxels(job, convertTo);
  });
  return smaller ? std::move(*smaller) : std::move(made);
}

void requireSigns(const ConvertInput& input, const SparseVolume& decoded) {
  const SignErrors errors = compareSigns(input.source, decoded);
  const std::string grid = "grid '" + shownName(input.descriptor.name) + "': ";
  if (errors.first)
    throw RuntimeFailure(
        grid + counted(errors.voxels, "voxel") + (errors.voxels == 1 ? " is" : " are") +
        " on the wrong side of the surface, for example voxel " + toString(*errors.first));
  if (!EmptySigns(decoded).agree())
    throw RuntimeFailure(grid + "the surface of the decoded voxels has holes");
}

}  // namespace esvr::encode
