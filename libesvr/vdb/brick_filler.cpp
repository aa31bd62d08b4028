#include "vdb/brick_filler.h"

#include <optional>
#include <string>

#include "core/counted.h"
#include "esvr/device.h"
#include "esvr/error.h"

namespace esvr::vdb {
namespace {

/// Bytes of a brick's values, of its mask and place in each volume, and of its place in lists while
/// the tree is read.
constexpr double kValueBytes = kBrickVoxels * sizeof(float);
constexpr double kEntryBytes = sizeof(BrickMask) + sizeof(Coord);
constexpr double kListBytes = 2.0 * sizeof(Coord);

void refuseTooFarApart(Coord low, Coord high) {
  constexpr std::int64_t kMaxExtent = std::numeric_limits<std::int32_t>::max() - kBrickSide;
  const std::int64_t extent = std::max(
      {std::int64_t(high.x) - low.x, std::int64_t(high.y) - low.y, std::int64_t(high.z) - low.z});
  if (extent > kMaxExtent)
    throw CannotConvert("its active voxels reach from " + toString(low) + " to " + toString(high) +
                        ": 2^31 voxels or more");
}

void refuseEmpty(std::size_t bricks, const FillRules& rules) {
  if (bricks == 0 && !rules.allowEmpty) throw BadInput("it has no active voxel");
}

}  // namespace

void InactiveCounter::tile(const TileSource& tile) {
  if (tile.value == background_) return;
  const std::int32_t last = tile.extent - 1;
  InactiveValues values;
  values.add(tile.value, Box{tile.corner, tile.corner + Coord{last, last, last}});
  if (isNegated(tile.value))
    negatedPlaces_.push_back({tile.corner, values});
  else
    others_.add(values);
}

void InactiveCounter::leaf(std::span<const double, kBrickVoxels> values, Coord corner) {
  InactiveValues negated;
  for (int i = 0; i < kBrickVoxels; ++i) {
    const double value = values[std::size_t(i)];
    if (value == background_) continue;
    (isNegated(value) ? negated : others_).add(value, corner + voxelLocal(i));
  }
  if (negated.count() > 0) negatedPlaces_.push_back({corner, negated});
}

InactiveValues InactiveCounter::lostIn(const SparseVolume& volume) const {
  InactiveValues lost = others_;
  if (negated_.count() == 0 && negatedPlaces_.empty()) return lost;
  std::optional<EmptySigns> signs;
  if (volume.brickCount() > 0 && volume.background > 0.0f) signs.emplace(volume);
  const bool isFilled = signs && signs->agree();
  if (!signs) lost.add(negated_);
  // A place without active voxels lies in one region of the empty space.
  for (const Place& place : negatedPlaces_)
    if (!isFilled || !signs->isInside(brickOf(place.corner))) lost.add(place.values);
  return lost;
}

float narrowBackground(double background) {
  const auto narrow = float(background);
  if (!std::isfinite(narrow))
    throw CannotConvert("its background, " + shortText(background) + ", is not a finite float");
  return narrow;
}

void refuseTooLarge(std::uint64_t bricks, const ReadOptions& options) {
  const std::string what =
      "it has " + counted(bricks, "brick") + " of 8^3 voxels, active tiles included, and";
  const double count = double(bricks), volumes = double(options.volumes);
  const bool isInFile = options.memory.isInFile(bricks * std::uint64_t(kValueBytes));
  const double values = isInFile ? 0.0 : kValueBytes;
  requireWithinMemory(count * (kListBytes + volumes * kEntryBytes + values), options.maxBytes,
                      what);
  if (isInFile) options.memory.requireRoom(count * volumes * kValueBytes, what);
}

void refuseNonFinite(const NonFiniteTally& tally, NonFinite nonFinite) {
  const Narrowing& narrowing = tally.narrowing;
  const double largest = std::max(std::abs(narrowing.min), std::abs(narrowing.max));
  if (narrowing.errors.count() > 0 && largest < double(std::numeric_limits<float>::min()))
    throw CannotConvert("all its values are too small for float; the largest magnitude is " +
                        shortText(largest));
  const bool areReplaced = nonFinite == NonFinite::kValue || nonFinite == NonFinite::kBackground;
  if (tally.count == 0 || areReplaced) return;
  const std::string voxels = counted(tally.count, "voxel") + (tally.count == 1 ? " is " : " are ");
  const std::string first = "; the first is at " + toString(tally.first);
  if (tally.tooLarge == tally.count)
    throw CannotConvert(voxels + "finite but too large for float" + first);
  throw NotFinite(voxels + "NaN, infinite or too large for float" + first);
}

void appendBricks(const TileSource& tile, std::vector<Coord>& corners) {
  for (std::int32_t x = 0; x < tile.extent; x += kBrickSide)
    for (std::int32_t y = 0; y < tile.extent; y += kBrickSide)
      for (std::int32_t z = 0; z < tile.extent; z += kBrickSide)
        corners.push_back(tile.corner + Coord{x, y, z});
}

SparseVolume layOutBricks(std::vector<Coord>& corners, const FillRules& rules,
                          const VoxelMemory& memory) {
  refuseEmpty(corners.size(), rules);
  SparseVolume volume;
  volume.background = rules.background;
  if (corners.empty()) return volume;
  std::ranges::sort(corners);
  Coord low = corners.front(), high = low;
  for (const Coord corner : corners) {
    low = minCoord(low, corner);
    high = maxCoord(high, corner);
  }
  refuseTooFarApart(low, high);
  volume.origin = low;
  volume.bricks.reserve(corners.size());
  for (const Coord corner : corners) {
    const Coord place = brickOf(corner - low);
    if (!volume.bricks.empty() && volume.bricks.back() == place)
      throw BadInput("it has two bricks at " + toString(corner));
    volume.bricks.push_back(place);
  }
  volume.values = VoxelArray<float>(corners.size() * kBrickVoxels, rules.background, memory);
  volume.active.resize(corners.size());
  return volume;
}

std::size_t brickAt(const SparseVolume& volume, Coord corner) {
  if (const auto b = brickWith(volume, corner)) return *b;
  throw BadInput("is damaged: there is no brick at " + toString(corner));
}

void fillTile(const TileSource& tile, SparseVolume& volume, NonFiniteTally& tally) {
  std::vector<Coord> corners;
  appendBricks(tile, corners);
  for (const Coord corner : corners) {
    const std::size_t b = brickAt(volume, corner);
    volume.active[b].setAll();
    const auto out = volume.brickValues(b);
    for (int i = 0; i < kBrickVoxels; ++i)
      out[i] = narrowValue(tile.value, corner + voxelLocal(i), tally);
  }
}

}  // namespace esvr::vdb
