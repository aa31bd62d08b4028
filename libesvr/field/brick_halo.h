#pragma once
/// The halo of a brick: its values and those of its neighbours, as far as SSIM windows reach.

#include <array>
#include <cstdint>
#include <span>

#include "core/brick_index.h"
#include "field/ssim_window.h"

namespace esvr {

/// The numbers in an index of a brick and its 26 neighbours, z fastest, with the brick itself in
/// the middle; BrickIndex::kNone for missing bricks.
using BricksAround = std::array<std::uint32_t, 27>;
[[nodiscard]] BricksAround bricksAround(const BrickIndex& index, Coord brick);

/// The smallest box of halo coordinates outside which all values are zero.
/// \param boxes  for each brick of the index, a box of local coordinates outside which it is zero
[[nodiscard]] Box haloSupport(const BricksAround& around, std::span<const Box> boxes);

/// The values of the 27 bricks, kBrickVoxels each; null for bricks that are zero.
template <class Value>
using ValuesAround = std::array<const Value*, 27>;

/// Fills a halo with the values as float64, so that window sums of their products are precise.
/// \param seen  halo coordinates to fill, which is extended to whole rows along z
void fillHalo(const ValuesAround<float>& bricks, const Box& seen, HaloValues& out);
void fillHalo(const ValuesAround<double>& bricks, const Box& seen, HaloValues& out);

}  // namespace esvr
