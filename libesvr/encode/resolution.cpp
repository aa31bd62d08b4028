// Grids at another resolution: the transform, averages over coarse voxels, and ellipsoids between voxels.

#include "esvr/resolution.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/counted.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/quantised.h"
#include "esvr/vdb_io.h"
#include "format/grid_rule.h"

namespace esvr {

// ---- The transform

namespace {

using Matrix = std::array<double, 16>;

void requireFactor(double factor) {
  if (!(factor >= kFinestFactor && factor <= kCoarsestFactor))
    throw UsageError("voxels can become between " + shortText(kFinestFactor) + " and " +
                     shortText(kCoarsestFactor) + " times as large, not " + shortText(factor) +
                     " times");
}

const Matrix& affineOf(const Transform& transform) {
  if (!transform.affine)
    throw UsageError(
        "the voxels of a frustum have no common size and cannot become larger or smaller");
  return *transform.affine;
}

}  // namespace

Transform transformAt(const Transform& transform, double factor) {
  requireFactor(factor);
  if (factor == 1.0) return transform;
  Matrix matrix = affineOf(transform);
  const double shift = 0.5 * (factor - 1.0);
  for (std::size_t column = 0; column < 4; ++column) {
    double moved = matrix[12 + column];
    for (std::size_t row = 0; row < 3; ++row) {
      moved += shift * matrix[4 * row + column];
      matrix[4 * row + column] *= factor;
    }
    matrix[12 + column] = moved;
  }
  matrix[3] = matrix[7] = matrix[11] = 0.0, matrix[15] = 1.0;
  return affineTransform(matrix);
}

double factorFor(const Transform& transform, double voxelSize) {
  const Matrix& m = affineOf(transform);
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t row = 0; row < 3; ++row)
    shortest = std::min(shortest, std::hypot(m[4 * row], m[4 * row + 1], m[4 * row + 2]));
  double factor = voxelSize / shortest;
  // A size that a user types need not be a double of its multiple.
  constexpr double kRounding = 1e-6;
  if (std::abs(factor - std::round(factor)) < kRounding * factor) factor = std::round(factor);
  requireFactor(factor);
  return factor;
}

// ---- The places of coarse voxels

namespace {

/// The bricks that a coarse brick of 8^3 voxels covers along an axis, in bricks of the source; `last` included.
struct Cover {
  std::int32_t first = 0, last = 0;
};

Cover coverOf(std::int32_t coarse, double factor) {
  const double begin = double(coarse) * kBrickSide * factor, end = begin + kBrickSide * factor;
  const auto brickAt = [](double voxel) { return std::int32_t(std::floor(voxel / kBrickSide)); };
  return {brickAt(begin), brickAt(std::ceil(end) - 1.0)};
}

/// The coarse bricks, in bricks, that voxels of a brick along an axis belong to.
Cover coarseOf(std::int32_t brick, double factor) {
  const auto brickAt = [&](double voxel) {
    return std::int32_t(std::floor(voxel / factor / kBrickSide));
  };
  const double begin = double(brick) * kBrickSide;
  // The space of the last voxel ends where that of the next brick begins.
  const double end = (begin + kBrickSide) / factor / kBrickSide;
  return {brickAt(begin), std::int32_t(std::ceil(end)) - 1};
}

/// The coarse bricks of a list of bricks, increasing.
std::vector<Coord> coarseBricks(std::span<const Coord> corners, double factor) {
  std::vector<Coord> coarse;
  for (const Coord corner : corners) {
    const Coord brick = brickOf(corner);
    const Cover x = coarseOf(brick.x, factor), y = coarseOf(brick.y, factor),
                z = coarseOf(brick.z, factor);
    for (std::int32_t i = x.first; i <= x.last; ++i)
      for (std::int32_t j = y.first; j <= y.last; ++j)
        for (std::int32_t k = z.first; k <= z.last; ++k)
          if (coarse.empty() || coarse.back() != Coord{i, j, k}) coarse.push_back({i, j, k});
  }
  std::ranges::sort(coarse);
  coarse.erase(std::unique(coarse.begin(), coarse.end()), coarse.end());
  return coarse;
}

/// Calls use(n) for the numbers of the bricks of an increasing list that a coarse brick covers.
template <class Use>
void forEachCovered(std::span<const Coord> bricks, Coord coarse, double factor, const Use& use) {
  const Cover x = coverOf(coarse.x, factor), y = coverOf(coarse.y, factor),
              z = coverOf(coarse.z, factor);
  for (std::int32_t i = x.first; i <= x.last; ++i)
    for (std::int32_t j = y.first; j <= y.last; ++j) {
      auto at = std::ranges::lower_bound(bricks, Coord{i, j, z.first});
      for (; at != bricks.end() && *at <= Coord{i, j, z.last}; ++at)
        use(std::size_t(at - bricks.begin()));
    }
}

// ---- Averages

/// The parts of the voxels of a brick along an axis that lie in the voxels of a coarse brick, in voxels of the source.
struct Parts {
  struct Part {
    int coarse = 0;  ///< 0 to 7; voxels beyond have no part
    double length = 0.0;
  };
  std::array<std::array<Part, 2>, kBrickSide> of{};

  Parts(std::int32_t brick, std::int32_t coarseBrick, double factor) {
    for (int v = 0; v < kBrickSide; ++v) {
      const double begin = double(brick) * kBrickSide + v;
      const double first = std::floor(begin / factor);
      for (int n = 0; n < 2; ++n) {
        const double coarse = first + n;
        const double length =
            std::min(begin + 1.0, (coarse + 1.0) * factor) - std::max(begin, coarse * factor);
        const double local = coarse - double(coarseBrick) * kBrickSide;
        if (length > 0.0 && local >= 0.0 && local < kBrickSide)
          of[std::size_t(v)][std::size_t(n)] = {int(local), length};
      }
    }
  }
};

/// What the voxels of a coarse brick have been given.
struct Sums {
  std::array<double, kBrickVoxels> difference{};  ///< values less the background, by volume
  std::array<double, kBrickVoxels> active{};      ///< volume of active voxels that are finite
  std::array<double, kBrickVoxels> missing{};     ///< volume of voxels that are not finite
};

/// How voxels become coarse ones.
struct AverageRule {
  double factor = 1.0;
  float background = 0.0f;
  bool onlyActive = false;  ///< the background is far from the values
  bool isSigned = false;    ///< inactive voxels inside a surface have the negated background
};

/// Adds a brick to a coarse one.
/// \param active  null: no voxel is active
void addVoxels(std::span<const float> values, const BrickMask* active,
               const std::array<Parts, 3>& parts, const AverageRule& rule, Sums& sums) {
  for (int v = 0; v < kBrickVoxels; ++v) {
    const float value = values[std::size_t(v)];
    const bool isActive = active && active->test(v);
    if (!isActive && (rule.onlyActive || value == rule.background)) continue;
    const Coord at = voxelLocal(v);
    for (const auto& x : parts[0].of[std::size_t(at.x)])
      for (const auto& y : parts[1].of[std::size_t(at.y)])
        for (const auto& z : parts[2].of[std::size_t(at.z)]) {
          const double volume = x.length * y.length * z.length;
          if (volume == 0.0) continue;
          const auto c = std::size_t(voxelOffset({x.coarse, y.coarse, z.coarse}));
          if (!std::isfinite(value)) {
            sums.missing[c] += volume;
            continue;
          }
          sums.difference[c] += volume * (double(value) - rule.background);
          if (isActive) sums.active[c] += volume;
        }
  }
}

BrickInput averageOf(Coord coarse, const Sums& sums, const AverageRule& rule) {
  BrickInput brick{coarse * kBrickSide, {}, {}};
  const double whole = rule.factor * rule.factor * rule.factor;
  for (int v = 0; v < kBrickVoxels; ++v) {
    const auto i = std::size_t(v);
    const bool isActive = sums.active[i] > 0.0 || sums.missing[i] > 0.0;
    double counted = rule.onlyActive ? sums.active[i] : whole - sums.missing[i];
    // Parts of a voxel add up to its volume but for rounding.
    if (counted < 1e-9 * whole) counted = 0.0;
    const auto mean = float(rule.background + (counted > 0.0 ? sums.difference[i] / counted : 0.0));
    const bool isMissing = sums.missing[i] > 0.0 && counted == 0.0;
    brick.values[i] = isMissing ? std::numeric_limits<float>::quiet_NaN() : mean;
    if (isActive)
      brick.active.set(v);
    else
      brick.values[i] = rule.isSigned && mean < 0.0f ? -rule.background : rule.background;
  }
  return brick;
}

/// Averages volumes that have some bricks of the source each.
class Averager {
 public:
  Averager(std::vector<Coord> coarse, const AverageRule& rule)
      : coarse_(std::move(coarse)), rule_(rule), sums_(coarse_.size()) {}

  /// \param signs  of the places without a brick of a level set that is complete; null: they have the background
  void add(const SparseVolume& volume, const EmptySigns* signs = nullptr) {
    std::vector<Coord> bricks = brickCorners(volume);
    for (Coord& brick : bricks) brick = brickOf(brick);
    parallelFor(std::size_t{0}, coarse_.size(), [&](std::size_t c) {
      forEachCovered(bricks, coarse_[c], rule_.factor, [&](std::size_t b) {
        addVoxels(volume.brickValues(b), &volume.active[b], partsOf(bricks[b], coarse_[c]), rule_,
                  sums_[c]);
      });
      if (signs) addInside(bricks, *signs, c);
    });
  }

  /// Appends the coarse bricks that have an active voxel.
  void appendTo(std::vector<BrickInput>& made) const {
    for (std::size_t c = 0; c < coarse_.size(); ++c)
      if (BrickInput brick = averageOf(coarse_[c], sums_[c], rule_); brick.active.count() > 0)
        made.push_back(std::move(brick));
  }

 private:
  [[nodiscard]] std::array<Parts, 3> partsOf(Coord brick, Coord coarse) const {
    return {Parts(brick.x, coarse.x, rule_.factor), Parts(brick.y, coarse.y, rule_.factor),
            Parts(brick.z, coarse.z, rule_.factor)};
  }

  /// Adds the places without a brick that lie inside a surface.
  void addInside(std::span<const Coord> bricks, const EmptySigns& signs, std::size_t c) {
    const std::vector<float> inside(kBrickVoxels, -rule_.background);
    const Cover x = coverOf(coarse_[c].x, rule_.factor), y = coverOf(coarse_[c].y, rule_.factor),
                z = coverOf(coarse_[c].z, rule_.factor);
    for (std::int32_t i = x.first; i <= x.last; ++i)
      for (std::int32_t j = y.first; j <= y.last; ++j)
        for (std::int32_t k = z.first; k <= z.last; ++k) {
          const Coord place{i, j, k};
          if (std::ranges::binary_search(bricks, place) || !signs.isInside(place)) continue;
          addVoxels(inside, nullptr, partsOf(place, coarse_[c]), rule_, sums_[c]);
        }
  }

  std::vector<Coord> coarse_;
  AverageRule rule_;
  std::vector<Sums> sums_;
};

// ---- A coarser grid

/// Bricks of the source, and coarse ones, that are in memory at the same time: 4 and 3 MB.
constexpr std::size_t kBricksAtOnce = 2048, kCoarseAtOnce = 256;
double bytesAtOnce(std::size_t bricks, std::size_t coarse) {
  return double(std::min(bricks, kBricksAtOnce)) *
             (kBrickVoxels * sizeof(float) + sizeof(BrickMask) + sizeof(Coord)) +
         double(std::min(coarse, kCoarseAtOnce)) * double(sizeof(Sums));
}
/// Of a coarse brick in the result. It is there twice for a moment.
constexpr double kBytesOfCoarse = 2.0 * sizeof(BrickInput);

/// Averages some coarse bricks at a time, so that their sums take little memory.
/// \param add  add(coarse, averager) gives the averager the volumes that these coarse bricks cover
template <class Add>
SparseVolume averagedBy(const AverageRule& rule, std::span<const Coord> coarse, const Add& add) {
  std::vector<BrickInput> made;
  for (std::size_t first = 0; first < coarse.size(); first += kCoarseAtOnce) {
    const auto some = coarse.subspan(first, std::min(kCoarseAtOnce, coarse.size() - first));
    Averager averager({some.begin(), some.end()}, rule);
    add(some, averager);
    averager.appendTo(made);
  }
  return makeVolume(std::move(made), rule.background);
}

AverageRule ruleFor(const StoredGrid& grid, double factor) {
  const auto background = float(grid.descriptor.background);
  return {.factor = factor,
          .background = background,
          .onlyActive = spanOf(ValueRange{grid.valueMin, grid.valueMax}, background).farBackground,
          .isSigned = grid.descriptor.gridClass == GridClass::kLevelSet && background > 0.0f};
}

/// A level set, whose empty space has signs.
SparseVolume averagedSurface(const StoredGrid& grid, const AverageRule& rule,
                             const DecodeOptions& options) {
  const SparseVolume volume = decodeGrid(grid, options);
  const EmptySigns signs(volume);
  return averagedBy(rule, coarseBricks(brickCorners(volume), rule.factor),
                    [&](std::span<const Coord>, Averager& to) { to.add(volume, &signs); });
}

/// The increasing corners of the bricks that coarse ones cover.
std::vector<Coord> coveredBy(std::span<const Coord> coarse, std::span<const Coord> bricks,
                             double factor) {
  std::vector<Coord> covered;
  for (const Coord c : coarse)
    forEachCovered(bricks, c, factor,
                   [&](std::size_t b) { covered.push_back(bricks[b] * kBrickSide); });
  std::ranges::sort(covered);
  covered.erase(std::unique(covered.begin(), covered.end()), covered.end());
  return covered;
}

SparseVolume averaged(const StoredGrid& grid, const AverageRule& rule,
                      const DecodeOptions& options) {
  if (rule.isSigned) return averagedSurface(grid, rule, options);
  std::vector<Coord> bricks = format::decodedBricks(grid, options);
  const std::vector<Coord> coarse = coarseBricks(bricks, rule.factor);
  requireWithinMemory(
      double(coarse.size()) * kBytesOfCoarse + bytesAtOnce(bricks.size(), coarse.size()),
      options.maxBytes, "grid '" + shownName(grid.descriptor.name) + "' at this resolution");
  for (Coord& brick : bricks) brick = brickOf(brick);
  return averagedBy(rule, coarse, [&](std::span<const Coord> some, Averager& to) {
    const std::vector<Coord> covered = coveredBy(some, bricks, rule.factor);
    for (std::size_t b = 0; b < covered.size(); b += kBricksAtOnce)
      to.add(format::decodeBricks(
          grid, options,
          std::span(covered).subspan(b, std::min(kBricksAtOnce, covered.size() - b))));
  });
}

// ---- A finer grid

/// The place of a coordinate of the source in the finer grid.
double finerPlace(double x, double factor) { return (x + 0.5) / factor - 0.5; }

/// The finer voxels whose centers lie in the space of the voxels of a box.
Box finerBox(const Box& box, double factor) {
  if (box.empty()) return box;
  const auto firstFrom = [&](double place) {
    return std::int32_t(
        std::clamp(std::ceil(place / factor - 0.5), double(Box::kMin), double(Box::kMax)));
  };
  return {{firstFrom(box.min.x), firstFrom(box.min.y), firstFrom(box.min.z)},
          {firstFrom(box.max.x + 1.0) - 1, firstFrom(box.max.y + 1.0) - 1,
           firstFrom(box.max.z + 1.0) - 1}};
}

Chunk finerChunk(const Chunk& chunk, double factor) {
  Chunk finer = chunk;
  const auto moved = [&](std::int32_t at) {
    return std::int32_t(std::floor(finerPlace(at, factor) / kBrickSide)) * kBrickSide;
  };
  finer.origin = {moved(chunk.origin.x), moved(chunk.origin.y), moved(chunk.origin.z)};
  const std::array<double, 3> from{double(chunk.origin.x), double(chunk.origin.y),
                                   double(chunk.origin.z)};
  const std::array<double, 3> to{double(finer.origin.x), double(finer.origin.y),
                                 double(finer.origin.z)};
  for (std::size_t a = 0; a < 3; ++a) {
    for (float& center : finer.ellipsoids.center[a])
      center = float(finerPlace(from[a] + double(center), factor) - to[a]);
    for (float& scale : finer.ellipsoids.logScale[a]) scale -= float(std::log(factor));
  }
  return finer;
}

SparseVolume interpolated(const StoredGrid& grid, double factor, const DecodeOptions& options) {
  if (!followsFromEllipsoids(grid) || grid.topology != TopologyKind::kThreshold)
    throw UsageError("grid '" + shownName(grid.descriptor.name) +
                     "' cannot become finer: only ellipsoids whose threshold decides which voxels "
                     "are active have values between voxels");
  StoredGrid finer = grid;
  finer.quantised.clear();
  finer.boxVoxels.clear();
  finer.field = amongOtherVoxels(std::move(finer.field), factor);
  finer.activeBox = finerBox(grid.activeBox, factor);
  DecodeOptions own = options;
  if (options.box) own.box = finerBox(*options.box, factor);
  return decodeGrid(finer, own);
}

}  // namespace

// ---- Grids

VolumeGrid decodeAtResolution(const StoredGrid& grid, double factor, const DecodeOptions& options) {
  VolumeGrid made{.descriptor = grid.descriptor, .volume = {}};
  made.descriptor.transform = transformAt(grid.descriptor.transform, factor);
  if (factor == 1.0)
    made.volume = decodeGrid(grid, options);
  else if (factor < 1.0)
    made.volume = interpolated(grid, factor, options);
  else
    made.volume = averaged(grid, ruleFor(grid, factor), options);
  if (factor > 1.0 && grid.descriptor.valueType == ValueType::kHalf) roundToHalfs(made.volume);
  return made;
}

SparseVolume coarsened(const SparseVolume& volume, int factor) {
  requireFactor(factor);
  const AverageRule rule{.factor = double(factor), .background = volume.background};
  return averagedBy(rule, coarseBricks(brickCorners(volume), factor),
                    [&](std::span<const Coord>, Averager& to) { to.add(volume); });
}

VectorGrid decodeVectorAtResolution(const std::string& name, StoredComponents components,
                                    double factor, const DecodeOptions& options) {
  return format::vectorsOf(name, components, options,
                           [&](const StoredGrid& component, const DecodeOptions& left) {
                             return decodeAtResolution(component, factor, left);
                           });
}

// ---- Carried grids

namespace {

/// Adds a carried grid as exact voxels.
/// \return false if it has no numbers with another resolution; nothing was added
bool addAsVoxels(const CarriedGrid& carried, const ReadOptions& read, EsvrFile& file) try {
  const GridSummary summary = inspectCarried(carried);
  const auto add = [&](const GridDescriptor& descriptor, const SparseVolume& volume) {
    file.grids.push_back(makeStoredVoxels(descriptor, volume, smallestExactLayer(volume)));
  };
  if (summary.isVector) {
    const VectorGrid vectors = readVector(carried, read);
    if (!vectors.descriptor.transform.affine) return false;
    file.vectors.push_back({vectors.descriptor.name, file.grids.size()});
    GridDescriptor component = vectors.descriptor;
    for (std::size_t c = 0; c < kComponents; ++c) {
      component.name = componentName(vectors.descriptor.name, c);
      component.background = vectors.background[c];
      add(component, vectors.components[c]);
      component.metadata.clear();  // component x has it
    }
    return true;
  }
  if (!summary.isScalar || !summary.skipReason.empty()) return false;
  const VolumeGrid grid = readGrid(carried, read);
  if (!grid.descriptor.transform.affine) return false;
  add(grid.descriptor, grid.volume);
  return true;
} catch (const CannotConvert&) {
  return false;
}

}  // namespace

EsvrFile withCarriedAsVoxels(const EsvrFile& file, const ReadOptions& read) {
  EsvrFile made{.metadata = file.metadata, .grids = {}, .layout = file.layout};
  for (const GridOfFile& grid : gridsInOrder(file)) {
    if (grid.isCarried) {
      if (addAsVoxels(file.carried[grid.index], read, made)) continue;
      const std::size_t place = made.grids.size() + made.carried.size();
      made.carried.push_back(file.carried[grid.index]);
      made.carried.back().place = std::uint32_t(place);
      continue;
    }
    const std::size_t first = grid.isVector ? file.vectors[grid.index].first : grid.index;
    if (grid.isVector) made.vectors.push_back({nameOf(file, grid), made.grids.size()});
    for (std::size_t g = first; g < first + (grid.isVector ? kComponents : 1); ++g) {
      made.grids.push_back(file.grids[g]);
      made.grids.back().reference.reset();  // it counts the grids of the other file
    }
  }
  return made;
}

// ---- Fields and memory

Field amongOtherVoxels(Field field, double factor) {
  for (Chunk& chunk : field.chunks) chunk = finerChunk(chunk, factor);
  return field;
}

ResolutionBytes bytesAtResolution(const StoredGrid& grid, double factor,
                                  const DecodeOptions& options) {
  requireFactor(factor);
  const std::vector<Coord> bricks = format::decodedBricks(grid, options);
  const std::size_t count = factor == 1.0 ? bricks.size() : coarseBricks(bricks, factor).size();
  const double result =
      double(count) * (kBrickVoxels * sizeof(float) + sizeof(BrickMask) + sizeof(Coord));
  return {std::uint64_t(result),
          factor > 1.0 ? std::uint64_t(bytesAtOnce(bricks.size(), count)) : 0};
}

}  // namespace esvr
