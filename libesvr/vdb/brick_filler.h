#pragma once
/// Builds a SparseVolume from the leaves and tiles of a tree, of OpenVDB or NanoVDB, without a copy
/// in between.
///
/// Active voxels keep their value, narrowed to float. Inactive voxels
/// become the background, since hosts leave anything there; in a level set, the background with the
/// sign they had, which says inside or outside.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"
#include "esvr/vdb_io.h"

namespace esvr::vdb {

/// How a grid's voxels become a volume's.
struct FillRules {
  float background = 0.0f;
  bool levelSet = false;
  NonFinite nonFinite = NonFinite::kRefuse;
  bool allowEmpty = false;
};

/// The background as float. \throws BadInput  not finite there
float narrowBackground(double background);

/// \throws MemoryExceeded  the bricks and the tree they come from take more than options.maxBytes
void refuseTooLarge(std::uint64_t bricks, std::uint64_t treeBytes, const ReadOptions& options);

/// Active voxels that float cannot hold: NaN, infinite, or a double out of range.
struct NonFiniteTally {
  std::uint64_t count = 0;
  Coord first;  ///< in the order of bricks, then of voxels within one

  void add(Coord voxel) {
    if (count++ == 0) first = voxel;
  }
};
/// \throws BadInput  there are some and they are not to be replaced
void refuseNonFinite(const NonFiniteTally& tally, NonFinite nonFinite);

/// The source that a brick is filled from.
template <class Leaf>
struct BrickSource {
  Coord corner;
  const Leaf* leaf = nullptr;  ///< null: an active tile, of
  double tileValue = 0.0;
};

/// Appends the bricks that a tile of `extent` voxels a side covers.
template <class Leaf>
void appendTile(Coord corner, std::int32_t extent, double value,
                std::vector<BrickSource<Leaf>>& sources) {
  for (std::int32_t x = 0; x < extent; x += kBrickSide)
    for (std::int32_t y = 0; y < extent; y += kBrickSide)
      for (std::int32_t z = 0; z < extent; z += kBrickSide)
        sources.push_back({corner + Coord{x, y, z}, nullptr, value});
}

/// A volume with bricks at these corners (increasing), all background and inactive.
/// \throws BadInput  two of one corner, or corners 2^31 voxels apart
SparseVolume layOutBricks(const std::vector<Coord>& corners, float background);

/// \throws BadInput  there is no brick, and the rules do not allow that
void refuseEmpty(std::size_t bricks, const FillRules& rules);

/// An active value as float; counted, and zero, where float cannot hold it.
inline float narrowValue(double value, Coord voxel, NonFiniteTally& tally) {
  const auto narrow = float(value);
  if (std::isfinite(narrow)) return narrow;
  tally.add(voxel);
  return 0.0f;
}

template <class Leaf, class Access>
void fillFromLeaf(const Leaf& leaf, const FillRules& rules, Coord corner, std::span<float> out,
                  const BrickMask& active, NonFiniteTally& tally) {
  for (int i = 0; i < kBrickVoxels; ++i) {
    const auto value = Access::value(leaf, i);
    if (active.test(i))
      out[i] = narrowValue(double(value), corner + voxelLocal(i), tally);
    else if (rules.levelSet)
      out[i] = value < 0 ? -std::abs(rules.background) : std::abs(rules.background);
  }
}

/// Builds the volume. Access::value(leaf, i) is a leaf's voxel in voxelOffset order,
/// Access::mask(leaf) its active voxels. \throws BadInput  no active voxel, where the rules do not
/// allow that; non-finite voxels
template <class Leaf, class Access>
SparseVolume buildVolume(std::vector<BrickSource<Leaf>> sources, const FillRules& rules,
                         NonFiniteTally& tally) {
  std::erase_if(sources,
                [](const auto& s) { return s.leaf && Access::mask(*s.leaf).count() == 0; });
  std::sort(sources.begin(), sources.end(),
            [](const auto& a, const auto& b) { return a.corner < b.corner; });
  std::vector<Coord> corners;
  corners.reserve(sources.size());
  for (const auto& source : sources) corners.push_back(source.corner);

  refuseEmpty(corners.size(), rules);
  SparseVolume volume = layOutBricks(corners, rules.background);
  for (std::size_t b = 0; b < sources.size(); ++b) {
    const auto& source = sources[b];
    BrickMask& active = volume.active[b];
    const auto out = volume.brickValues(b);
    if (source.leaf) {
      active = Access::mask(*source.leaf);
      fillFromLeaf<Leaf, Access>(*source.leaf, rules, source.corner, out, active, tally);
    } else {
      active.setAll();
      for (int i = 0; i < kBrickVoxels; ++i)
        out[i] = narrowValue(source.tileValue, source.corner + voxelLocal(i), tally);
    }
  }
  refuseNonFinite(tally, rules.nonFinite);
  return volume;
}

}  // namespace esvr::vdb
