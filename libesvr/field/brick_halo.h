#pragma once
/// A brick's values with those of its neighbours, as far as windows reach.

#include <array>
#include <cstdint>
#include <span>

#include "core/brick_index.h"
#include "field/ssim_window.h"

namespace esvr {

/// Positions in an index of the 27 bricks around a place, itself in the middle, z fastest;
/// BrickIndex::kNone where there is none.
using BricksAround = std::array<std::uint32_t, 27>;
[[nodiscard]] BricksAround bricksAround(const BrickIndex& index, Coord brick);

/// The smallest box of halo coordinates outside which all is zero.
/// \param boxes  of each brick of the index, in its local coordinates: zero outside
[[nodiscard]] Box haloSupport(const BricksAround& around, std::span<const Box> boxes);

/// Arrays of kBrickVoxels, null for bricks that are zero.
template <class Value>
using ValuesAround = std::array<const Value*, 27>;

/// Makes float64 of them, so that products and sums of windows lose nothing.
/// \param seen  halo coordinates to fill; rows along z are filled whole
void fillHalo(const ValuesAround<float>& bricks, const Box& seen, HaloValues& out);
void fillHalo(const ValuesAround<double>& bricks, const Box& seen, HaloValues& out);

}  // namespace esvr
