#pragma once
/// Slabs of one voxel's thickness.

#include <cstddef>

#include "esvr/render.h"

namespace esvr::render {

/// A clip box around a slice, which is unbounded along the other axes.
/// \param axis   0, 1 or 2 for x, y or z
/// \param place  middle of the slice along the axis
[[nodiscard]] PlaceBox sliceBox(std::size_t axis, double place);

}  // namespace esvr::render
