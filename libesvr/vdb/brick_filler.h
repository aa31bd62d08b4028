#pragma once
/// Builds a SparseVolume from the leaves and tiles of a tree of OpenVDB or NanoVDB, without an
/// intermediate copy.
///
/// Active voxels keep their value, rounded to float. Inactive voxels become the background, because
/// applications leave arbitrary values there. In a level set they become the background with the
/// sign that they had, which distinguishes inside from outside.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"
#include "esvr/vdb_io.h"

namespace esvr::vdb {

/// The rules by which the voxels of a grid become those of a volume.
struct FillRules {
  float background = 0.0f;
  bool levelSet = false;
  NonFinite nonFinite = NonFinite::kRefuse;
  bool allowEmpty = false;
};

/// The background as float. \throws BadInput  it is not finite as float
float narrowBackground(double background);

/// \throws MemoryExceeded  the bricks and the tree together take more than options.maxBytes
void refuseTooLarge(std::uint64_t bricks, std::uint64_t treeBytes, const ReadOptions& options);

/// Active voxels that float cannot hold: NaN, infinite values, and doubles out of range.
struct NonFiniteTally {
  std::uint64_t count = 0;
  Coord first;  ///< the first one in the order of bricks and of voxels in a brick

  void add(Coord voxel) {
    if (count++ == 0 || std::pair(brickOf(voxel), voxel) < std::pair(brickOf(first), first))
      first = voxel;
  }
};
/// \throws BadInput  there are such voxels, and they are not to be replaced
void refuseNonFinite(const NonFiniteTally& tally, NonFinite nonFinite);

/// The leaf or tile from which a brick is filled.
template <class Leaf>
struct BrickSource {
  Coord corner;
  const Leaf* leaf = nullptr;  ///< null: the source is an active tile
  double tileValue = 0.0;
};

/// Appends the bricks that a tile with a side of `extent` voxels covers.
template <class Leaf>
void appendTile(Coord corner, std::int32_t extent, double value,
                std::vector<BrickSource<Leaf>>& sources) {
  for (std::int32_t x = 0; x < extent; x += kBrickSide)
    for (std::int32_t y = 0; y < extent; y += kBrickSide)
      for (std::int32_t z = 0; z < extent; z += kBrickSide)
        sources.push_back({corner + Coord{x, y, z}, nullptr, value});
}

/// A volume with bricks at these corners (increasing), whose voxels are inactive and have the
/// background.
/// \throws BadInput  two corners are equal, or are 2^31 voxels apart
SparseVolume layOutBricks(const std::vector<Coord>& corners, float background,
                          const VoxelMemory& memory);

/// \throws BadInput  there is no brick, and the rules do not allow this
void refuseEmpty(std::size_t bricks, const FillRules& rules);

/// An active value as float. A value that float cannot hold is counted and becomes 0.
inline float narrowValue(double value, Coord voxel, NonFiniteTally& tally) {
  const auto narrow = float(value);
  if (std::isfinite(narrow)) return narrow;
  tally.add(voxel);
  return 0.0f;
}

/// Fills a brick. Access::value(leaf, i) is a leaf's voxel in voxelOffset order.
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

/// Makes a volume with all bricks that have an active voxel. The masks are set, and the bricks of
/// tiles have their values. Access::mask(leaf) holds the active voxels of a leaf.
/// \throws BadInput  there is no active voxel, and the rules do not allow this
template <class Leaf, class Access>
SparseVolume volumeFor(std::vector<BrickSource<Leaf>>& sources, const FillRules& rules,
                       const VoxelMemory& memory, NonFiniteTally& tally) {
  std::erase_if(sources,
                [](const auto& s) { return s.leaf && Access::mask(*s.leaf).count() == 0; });
  std::sort(sources.begin(), sources.end(),
            [](const auto& a, const auto& b) { return a.corner < b.corner; });
  std::vector<Coord> corners;
  corners.reserve(sources.size());
  for (const auto& source : sources) corners.push_back(source.corner);

  refuseEmpty(corners.size(), rules);
  SparseVolume volume = layOutBricks(corners, rules.background, memory);
  for (std::size_t b = 0; b < sources.size(); ++b) {
    const auto& source = sources[b];
    if (source.leaf) {
      volume.active[b] = Access::mask(*source.leaf);
      continue;
    }
    volume.active[b].setAll();
    const auto out = volume.brickValues(b);
    for (int i = 0; i < kBrickVoxels; ++i)
      out[i] = narrowValue(source.tileValue, source.corner + voxelLocal(i), tally);
  }
  return volume;
}

}  // namespace esvr::vdb
