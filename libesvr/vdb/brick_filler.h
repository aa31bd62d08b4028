#pragma once
/// Builds a SparseVolume from the leaves and tiles of a tree of OpenVDB or NanoVDB, without an
/// intermediate copy.
///
/// Active voxels keep their value, rounded to float. Inactive voxels become the background, because
/// applications leave arbitrary values there; other values are counted (InactiveCounter). In a level
/// set they become the background with the sign that they had, which distinguishes inside from
/// outside.

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "esvr/vdb_io.h"
#include "esvr/volume.h"

namespace esvr::vdb {

/// Active voxels that float cannot hold: NaN, infinite values, and doubles out of range; and what the others lose.
struct NonFiniteTally {
  float replacement = 0.0f;  ///< which they become
  bool keeps = false;        ///< NaN and infinite values remain, and are not counted
  std::uint64_t count = 0;
  std::uint64_t tooLarge = 0;  ///< of them, those that are finite
  Coord first{};               ///< the first one in the order of bricks and of voxels in a brick
  Narrowing narrowing{};

  void add(double value, Coord voxel) {
    tooLarge += std::isfinite(value);
    if (count++ == 0 || std::pair(brickOf(voxel), voxel) < std::pair(brickOf(first), first))
      first = voxel;
  }
};

/// The rules by which the voxels of a grid become those of a volume.
struct FillRules {
  float background = 0.0f;
  bool levelSet = false;
  NonFinite nonFinite = NonFinite::kRefuse;
  float nonFiniteValue = 0.0f;
  bool allowEmpty = false;
  bool countInactive = true;  ///< false for leaves whose inactive values are approximations

  [[nodiscard]] NonFiniteTally tally() const {
    return {.replacement = nonFinite == NonFinite::kBackground ? background : nonFiniteValue,
            .keeps = nonFinite == NonFinite::kKeep};
  }
};

/// The background as float. \throws BadInput  it is not finite as float
float narrowBackground(double background);

/// \throws MemoryExceeded  the bricks take more than options.maxBytes, or their values more than the
///                         disk has free if they are kept in files
void refuseTooLarge(std::uint64_t bricks, const ReadOptions& options);

/// \throws NotFinite  there are such voxels, and they are not to be replaced
/// \throws CannotConvert  there are finite ones, which are not to be replaced, or all values are too small for float
void refuseNonFinite(const NonFiniteTally& tally, NonFinite nonFinite);

/// A tile.
struct TileSource {
  Coord corner;
  std::int32_t extent = 0;  ///< side, voxels
  double value = 0.0;
};

/// Counts inactive values that are lost because a volume does not hold them.
class InactiveCounter {
 public:
  InactiveCounter(double background, bool levelSet)
      : background_(background), levelSet_(levelSet) {}

  /// Adds an inactive voxel of a leaf that has active voxels, too.
  void voxel(double value, Coord at) {
    if (value != background_) (isNegated(value) ? negated_ : others_).add(value, at);
  }
  /// Adds an inactive tile.
  void tile(const TileSource& tile);
  /// Adds a leaf without active voxels.
  /// \param values  in voxelOffset order
  void leaf(std::span<const double, kBrickVoxels> values, Coord corner);

  /// The values that a writer does not restore from the volume: all that are not the background,
  /// but for the background with a negative sign in leaves of a level set, and where a flood fill restores it.
  [[nodiscard]] InactiveValues lostIn(const SparseVolume& volume) const;

 private:
  /// Values in a tile or a leaf without active voxels.
  struct Place {
    Coord corner;
    InactiveValues values;
  };

  [[nodiscard]] bool isNegated(double value) const { return levelSet_ && value == -background_; }

  double background_;
  bool levelSet_;
  InactiveValues others_;
  InactiveValues negated_;              ///< in leaves with active voxels
  std::vector<Place> negatedPlaces_{};  ///< elsewhere
};

/// What is found while a volume is filled.
struct FillTallies {
  NonFiniteTally nonFinite;
  InactiveCounter inactive;
};

/// Appends the corners of the bricks that a tile covers.
void appendBricks(const TileSource& tile, std::vector<Coord>& corners);

/// Makes a volume with bricks at these corners, which are sorted. Its voxels are inactive and have
/// the background.
/// \throws BadInput  two corners are equal, or are 2^31 voxels apart; there is none, and the rules
///                   do not allow this
SparseVolume layOutBricks(std::vector<Coord>& corners, const FillRules& rules,
                          const VoxelMemory& memory);

/// Number of the brick with this corner. \throws BadInput  the volume does not have it
std::size_t brickAt(const SparseVolume& volume, Coord corner);

/// Fills the bricks that an active tile covers.
void fillTile(const TileSource& tile, SparseVolume& volume, NonFiniteTally& tally);

/// An active value as float. A value that float cannot hold is counted and replaced.
inline float narrowValue(double value, Coord voxel, NonFiniteTally& tally) {
  const auto narrow = float(value);
  if (std::isfinite(narrow)) {
    tally.narrowing.add(value, narrow, voxel);
    return narrow;
  }
  if (tally.keeps && !std::isfinite(value))
    return std::isnan(value) ? std::numeric_limits<float>::quiet_NaN() : narrow;
  tally.add(value, voxel);
  return tally.replacement;
}

/// Fills brick b. access.value(leaf, i) is a leaf's voxel in voxelOffset order, and
/// access.mask(leaf) holds its active voxels.
template <class Leaf, class Access>
void fillFromLeaf(const Leaf& leaf, const Access& access, const FillRules& rules, std::size_t b,
                  SparseVolume& volume, FillTallies& tallies) {
  const Coord corner = volume.brickCorner(b);
  const auto out = volume.brickValues(b);
  const BrickMask active = volume.active[b] = access.mask(leaf);
  for (int i = 0; i < kBrickVoxels; ++i) {
    const auto value = access.value(leaf, i);
    if (active.test(i)) {
      out[i] = narrowValue(double(value), corner + voxelLocal(i), tallies.nonFinite);
      continue;
    }
    if (rules.countInactive) tallies.inactive.voxel(double(value), corner + voxelLocal(i));
    if (rules.levelSet)
      out[i] = value < 0 ? -std::abs(rules.background) : std::abs(rules.background);
  }
}

/// Counts the values of a leaf without active voxels, which has no brick.
template <class Leaf, class Access>
void countInactiveLeaf(const Leaf& leaf, const Access& access, const FillRules& rules, Coord corner,
                       FillTallies& tallies) {
  if (!rules.countInactive) return;
  std::array<double, kBrickVoxels> values{};
  for (int i = 0; i < kBrickVoxels; ++i) values[std::size_t(i)] = double(access.value(leaf, i));
  tallies.inactive.leaf(values, corner);
}

}  // namespace esvr::vdb
