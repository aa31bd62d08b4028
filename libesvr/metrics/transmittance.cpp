// The PSNR of transmittance. Volumes are projected along the three axes in one pass over their
// bricks, into pictures that consist of tiles of 8 x 8 columns. A tile is there where a brick is.
#include "metrics/transmittance.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "metrics/brick_pairs.h"

namespace esvr::metrics {
namespace {

// Tiles.

constexpr Transmittances kShares{0.9, 0.5, 0.1};

TilePlace placeOf(Coord brick, std::size_t axis) {
  if (axis == 0) return {brick.y, brick.z};
  if (axis == 1) return {brick.x, brick.z};
  return {brick.x, brick.y};
}

// Projecting.

/// The sums of a brick along the three axes.
struct Faces {
  std::array<std::array<double, kTileColumns>, kAxes> sums;
  double largest = 0.0;  ///< depth of a voxel
  bool isFinite = true;
};

/// How values become depths.
struct DepthRule {
  double empty = 0.0;  ///< depth of a voxel outside the bricks; sums are relative to it

  [[nodiscard]] double operator()(float value) const {
    return std::max(double(value), 0.0) - empty;
  }
};

bool areFinite(std::span<const float> values) {
  constexpr std::uint32_t kExponent = 0x7f800000u;  // all of its bits are set in infinities and NaN
  std::uint32_t bad = 0;
  for (const float value : values)
    bad |= std::uint32_t((std::bit_cast<std::uint32_t>(value) & kExponent) == kExponent);
  return bad == 0;
}

/// The depths of a brick's voxels; those outside the box are 0.
void takeDepths(std::span<const float> values, const Box& local, const DepthRule& rule,
                std::array<double, kBrickVoxels>& depths) {
  if (local.volume() == double(kBrickVoxels)) {
    for (std::size_t v = 0; v < depths.size(); ++v) depths[v] = rule(values[v]);
    return;
  }
  depths.fill(0.0);
  for (int x = local.min.x; x <= local.max.x; ++x)
    for (int y = local.min.y; y <= local.max.y; ++y)
      for (int z = local.min.z; z <= local.max.z; ++z) {
        const auto v = std::size_t(voxelOffset({x, y, z}));
        depths[v] = rule(values[v]);
      }
}

/// Adds up a brick. The order of the additions does not depend on anything.
void addUp(const std::array<double, kBrickVoxels>& depths, Faces& faces) {
  auto& [alongX, alongY, alongZ] = faces.sums;
  alongX.fill(0.0);
  alongY.fill(0.0);
  for (int x = 0; x < kBrickSide; ++x)
    for (int y = 0; y < kBrickSide; ++y) {
      const double* const row = &depths[std::size_t(voxelOffset({x, y, 0}))];
      for (int z = 0; z < kBrickSide; ++z) alongX[y * kBrickSide + z] += row[z];
      for (int z = 0; z < kBrickSide; ++z) alongY[x * kBrickSide + z] += row[z];
      alongZ[x * kBrickSide + y] =
          ((row[0] + row[1]) + (row[2] + row[3])) + ((row[4] + row[5]) + (row[6] + row[7]));
    }
}

[[noreturn]] void throwNotFinite(const SparseVolume& volume, std::size_t brick) {
  const auto values = volume.brickValues(brick);
  const auto bad =
      std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
  const Coord at = volume.brickCorner(brick) + voxelLocal(int(bad - values.begin()));
  throw BadInput("the value at " + toString(at) + " is not finite");
}

/// The depths of a volume's columns, and the largest one of a voxel.
struct Projection {
  TileDepths depths;
  double largest = 0.0;
};

/// Projects a volume. The faces of a part of the bricks are formed by all threads, and each row of
/// each tile is then added to by one thread in the order of the bricks, so that the sums do not
/// depend on the number of threads.
Projection project(const SparseVolume& volume, const TileLayout& layout, const Box& box,
                   const DepthRule& rule) {
  constexpr std::size_t kPart = 2048;  // bricks, whose faces take 3 MB
  constexpr std::size_t kBricksPerTask = 32;
  constexpr std::size_t kRows = kAxes * kBrickSide;
  Projection made;
  TileDepths& sums = made.depths;
  for (std::size_t axis = 0; axis < kAxes; ++axis)
    sums[axis].assign(layout.places[axis].size() * kTileColumns, 0.0);
  std::vector<Faces> faces(std::min(kPart, volume.brickCount()));
  for (std::size_t begin = 0; begin < volume.brickCount(); begin += kPart) {
    const std::size_t count = std::min(kPart, volume.brickCount() - begin);
    parallelFor(tbb::blocked_range<std::size_t>(0, count, kBricksPerTask), [&](const auto& part) {
      std::array<double, kBrickVoxels> depths;
      for (std::size_t i = part.begin(); i != part.end(); ++i) {
        const auto values = volume.brickValues(begin + i);
        const Box local = localBox(brickOf(volume.brickCorner(begin + i)), box);
        faces[i].isFinite = areFinite(values);
        takeDepths(values, local, rule, depths);
        addUp(depths, faces[i]);
        faces[i].largest = *std::max_element(depths.begin(), depths.end());
      }
    });
    for (std::size_t i = 0; i < count; ++i) {
      if (!faces[i].isFinite) throwNotFinite(volume, begin + i);
      made.largest = std::max(made.largest, faces[i].largest);
    }
    parallelFor(std::size_t{0}, kRows, [&](std::size_t row) {
      const std::size_t axis = row / kBrickSide, first = row % kBrickSide * kBrickSide;
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t tile = layout.tileOfBrick[axis][begin + i];
        double* const to = &sums[axis][tile * kTileColumns + first];
        const double* const from = &faces[i].sums[axis][first];
        for (int c = 0; c < kBrickSide; ++c) to[c] += from[c];
      }
    });
  }
  return made;
}

/// The upper median of the columns that are deeper than a thousandth of the largest value; 0 if no
/// value is above 0.
double medianOf(const TileDepths& depths, double largest) {
  constexpr double kThousandth = 1e-3;
  std::vector<double> deep;
  for (const auto& picture : depths)
    for (const double depth : picture)
      if (depth > kThousandth * largest) deep.push_back(depth);
  if (deep.empty()) return 0.0;
  const auto middle = deep.begin() + std::ptrdiff_t(deep.size() / 2);
  std::nth_element(deep.begin(), middle, deep.end());
  return *middle;
}

/// TransmittanceReference::medianDepth without the rest.
double medianDepthOf(const SparseVolume& volume, const Box& box) {
  if (box.empty() || volume.background > 0.0f) return 0.0;
  const Projection made = project(volume, TileLayout(volume), box, {});
  return medianOf(made.depths, made.largest);
}

// The median column of a field, from some of its tiles.

/// Bricks of some of the tiles along an axis, at most so many unless one tile has more.
std::vector<Coord> someRows(std::span<const Coord> corners, std::size_t axis) {
  constexpr std::size_t kMostBricks = 2048;
  const auto placeAt = [&](Coord corner) { return placeOf(brickOf(corner), axis); };
  std::vector<TilePlace> places;
  for (const Coord corner : corners) places.push_back(placeAt(corner));
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  const std::size_t stride = (corners.size() + kMostBricks - 1) / kMostBricks;
  std::vector<Coord> some;
  for (const Coord corner : corners) {
    const auto at =
        std::lower_bound(places.begin(), places.end(), placeAt(corner)) - places.begin();
    // A stride that begins in the middle of its first interval takes tiles from everywhere.
    if (std::size_t(at) % stride == stride / 2) some.push_back(corner);
  }
  return some;
}

/// The values of a field in bricks, within limits.
SparseVolume evaluated(const Field& field, std::span<const Coord> corners, const ValueRange& limits,
                       ToneCurve tone) {
  SparseVolume volume;
  if (corners.empty()) return volume;
  Coord first = corners.front();
  for (const Coord corner : corners) first = minCoord(first, corner);
  volume.origin = first;
  volume.background = field.background;
  for (const Coord corner : corners) volume.bricks.push_back(brickOf(corner - first));
  volume.active.resize(corners.size());
  volume.values.resize(corners.size() * kBrickVoxels);
  evaluateBricks(field, corners, volume.values);
  for (float& value : volume.values) value = std::clamp(tone.value(value), limits.min, limits.max);
  return volume;
}

double estimatedMedianDepth(const Field& field, const Box& box, const ValueRange& range,
                            ToneCurve tone) {
  ValueRange limits = range;
  limits.expand(field.background);
  const std::vector<Coord> corners = reachedBricks(field, box);
  TileDepths depths;
  double largest = 0.0;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const SparseVolume some = evaluated(field, someRows(corners, axis), limits, tone);
    Projection made = project(some, TileLayout(some), box, {});
    depths[axis] = std::move(made.depths[axis]);
    largest = std::max(largest, made.largest);
  }
  return medianOf(depths, largest);
}

// Comparing.

/// What the transmittances of two volumes have in common.
struct Scale {
  Box box;
  double medianDepth = 0.0;

  /// The number of voxels of a column.
  [[nodiscard]] double length(std::size_t axis) const {
    if (axis == 0) return double(box.max.x) - box.min.x + 1;
    if (axis == 1) return double(box.max.y) - box.min.y + 1;
    return double(box.max.z) - box.min.z + 1;
  }
  [[nodiscard]] double columns(std::size_t axis) const { return box.volume() / length(axis); }

  [[nodiscard]] Transmittances through(double depth) const {
    Transmittances light;
    for (std::size_t t = 0; t < kTransmittances; ++t)
      light[t] = std::exp(std::log(kShares[t]) * (depth / medianDepth));
    return light;
  }
};

/// One of the three pictures of a volume.
struct Picture {
  std::span<const TilePlace> places;
  std::span<const double> depths;
  std::span<const Transmittances> light{};  ///< empty: not computed yet
};

/// A tile of the reference, of the other volume or of both.
struct TilePair {
  TilePlace place;
  const double* depths = nullptr;         ///< of the reference; null where it has no tile
  const Transmittances* light = nullptr;  ///< of the same columns
  const double* others = nullptr;         ///< of the other volume; null where it has no tile
};

std::vector<TilePair> pairTiles(const Picture& reference, const Picture& other) {
  std::vector<TilePair> pairs;
  std::size_t a = 0, b = 0;
  const auto &ours = reference.places, &theirs = other.places;
  while (a < ours.size() || b < theirs.size()) {
    const bool takesOurs = b == theirs.size() || (a < ours.size() && ours[a] <= theirs[b]);
    TilePair pair{.place = takesOurs ? ours[a] : theirs[b]};
    if (b < theirs.size() && theirs[b] == pair.place)
      pair.others = &other.depths[b++ * kTileColumns];
    if (takesOurs) {
      pair.depths = &reference.depths[a * kTileColumns];
      pair.light = &reference.light[a++ * kTileColumns];
    }
    pairs.push_back(pair);
  }
  return pairs;
}

/// The columns of a tile that lie in the box, as a local box of a brick of the tile in the box.
Box columnsIn(TilePlace place, std::size_t axis, const Box& box) {
  const Coord in = brickOf(box.min);
  if (axis == 0) return localBox({in.x, place.a, place.b}, box);
  if (axis == 1) return localBox({place.a, in.y, place.b}, box);
  return localBox({place.a, place.b, in.z}, box);
}

struct Squares {
  Transmittances sums{};
  double columns = 0.0;

  void add(const Transmittances& a, const Transmittances& b, double times) {
    for (std::size_t t = 0; t < kTransmittances; ++t)
      sums[t] += times * (a[t] - b[t]) * (a[t] - b[t]);
    columns += times;
  }
};

Squares joined(Squares a, const Squares& b) {
  for (std::size_t t = 0; t < kTransmittances; ++t) a.sums[t] += b.sums[t];
  a.columns += b.columns;
  return a;
}

/// Compares the pictures along an axis. The sums are formed by a tree that depends on the number of
/// tiles only. \param empty  depth of a column of the other volume without a brick, beyond which its depths are
Squares compare(const Scale& scale, std::size_t axis, std::span<const TilePair> pairs,
                double empty) {
  constexpr std::size_t kPairsPerTask = 16;
  const Transmittances clear = scale.through(0.0);
  const auto addTile = [&](const TilePair& pair, Squares& squares) {
    const Box in = columnsIn(pair.place, axis, scale.box);
    const auto [firstA, firstB] = placeOf(in.min, axis);
    const auto [lastA, lastB] = placeOf(in.max, axis);
    for (int a = firstA; a <= lastA; ++a)
      for (int b = firstB; b <= lastB; ++b) {
        const int c = a * kBrickSide + b;
        const double depth = pair.depths ? pair.depths[c] : 0.0;
        const double other = empty + (pair.others ? pair.others[c] : 0.0);
        const Transmittances& light = pair.depths ? pair.light[c] : clear;
        squares.add(light, other == depth ? light : scale.through(other), 1.0);
      }
  };
  Squares squares = parallelDeterministicReduce(
      tbb::blocked_range<std::size_t>(0, pairs.size(), kPairsPerTask), Squares{},
      [&](const auto& part, Squares sums) {
        for (std::size_t i = part.begin(); i != part.end(); ++i) addTile(pairs[i], sums);
        return sums;
      },
      joined);
  const double rest = scale.columns(axis) - squares.columns;  // columns without a brick
  if (rest > 0.0) squares.add(clear, scale.through(empty), rest);
  return squares;
}

}  // namespace

TileLayout::TileLayout(const SparseVolume& volume) : origin(volume.origin), bricks(volume.bricks) {
  const Coord first = brickOf(origin);
  parallelFor(std::size_t{0}, kAxes, [&](std::size_t axis) {
    auto& all = places[axis];
    all.reserve(bricks.size());
    for (const Coord brick : bricks) all.push_back(placeOf(first + brick, axis));
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    auto& tiles = tileOfBrick[axis];
    tiles.reserve(bricks.size());
    for (const Coord brick : bricks) {
      const auto tile = std::lower_bound(all.begin(), all.end(), placeOf(first + brick, axis));
      tiles.push_back(std::uint32_t(tile - all.begin()));
    }
  });
}

TransmittanceReference::TransmittanceReference(const SparseVolume& reference,
                                               const std::optional<Box>& box)
    : box_(box.value_or(activeBox(reference))), layout_(reference) {
  if (box_.empty() || reference.background > 0.0f) return;
  Projection made = project(reference, layout_, box_, {});
  medianDepth_ = medianOf(made.depths, made.largest);
  depths_ = std::move(made.depths);
  if (!isDefined()) return;
  const Scale scale{box_, medianDepth_};
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    transmittances_[axis].resize(depths_[axis].size());
    parallelFor(tbb::blocked_range<std::size_t>(0, depths_[axis].size(), kTileColumns),
                [&](const auto& part) {
                  for (std::size_t c = part.begin(); c != part.end(); ++c)
                    transmittances_[axis][c] = scale.through(depths_[axis][c]);
                });
  }
}

TransmittancePsnr TransmittanceReference::measure(const SparseVolume& volume) const {
  if (!std::isfinite(volume.background)) throw BadInput("the background is not finite");
  if (!isDefined()) throw UsageError("the box has no column of voxels that absorbs light");
  const Scale scale{box_, medianDepth_};
  const DepthRule rule{DepthRule{}(volume.background)};
  std::optional<TileLayout> own;
  if (!layout_.isOf(volume)) own.emplace(volume);
  const TileLayout& layout = own ? *own : layout_;
  const TileDepths sums = project(volume, layout, box_, rule).depths;
  Squares squares;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const auto pairs = pairTiles({layout_.places[axis], depths_[axis], transmittances_[axis]},
                                 {layout.places[axis], sums[axis]});
    squares = joined(squares, compare(scale, axis, pairs, rule.empty * scale.length(axis)));
  }
  const auto psnrOf = [&](std::size_t t) {  // infinite without an error
    return -10.0 * std::log10(squares.sums[t] / squares.columns);
  };
  return {medianDepth_, psnrOf(0), psnrOf(1), psnrOf(2)};
}

}  // namespace esvr::metrics

namespace esvr {

bool isLookedThrough(GridClass gridClass, const SparseVolume& volume) {
  if (volume.background > 0.0f) return false;
  if (gridClass == GridClass::kFogVolume) return true;
  return gridClass == GridClass::kUnknown && activeVoxelCount(volume) > 0 &&
         activeRange(volume).min >= 0.0f;
}

std::optional<TransmittancePsnr> transmittancePsnr(const SparseVolume& reference,
                                                   const SparseVolume& candidate,
                                                   const std::optional<Box>& box) {
  const metrics::TransmittanceReference measure(reference, box);
  return measure.isDefined() ? std::optional(measure.measure(candidate)) : std::nullopt;
}

std::optional<double> medianDepth(const SparseVolume& volume, const std::optional<Box>& box) {
  const double median = metrics::medianDepthOf(volume, box.value_or(activeBox(volume)));
  return median > 0.0 ? std::optional(median) : std::nullopt;
}

std::optional<double> medianDepth(const Field& field, const Box& box, const ValueRange& range,
                                  ToneCurve tone) {
  if (box.empty() || field.background > 0.0f) return std::nullopt;
  const double median = metrics::estimatedMedianDepth(field, box, range, tone);
  return median > 0.0 ? std::optional(median) : std::nullopt;
}

}  // namespace esvr
