#pragma once
/// Makes NanoVDB grids from OpenVDB grids. The conversions are templates that take a minute to
/// compile, so they are in one translation unit.

#include <openvdb/Grid.h>

#include "esvr/nano_volume.h"
#include "vdb/nano_io.h"

namespace esvr::vdb {

using NanoHandle = nanovdb::GridHandle<nanovdb::HostBuffer>;

struct NanoForm {
  NanoValues values = NanoValues::kFloat;
  float tolerance = -1.0f;  ///< for kFpN: largest error in value units; below 0: NanoVDB chooses it
};

/// Converts a grid of floats to a form, or a grid of doubles to doubles, without dithering.
/// \throws std::logic_error  the grid has another type, or is one of doubles and the form is not
///                           kFloat
[[nodiscard]] NanoHandle makeNano(const openvdb::GridBase& grid, const NanoForm& form = {});

}  // namespace esvr::vdb
