#pragma once
/// NanoVDB grids of OpenVDB's. The conversions are templates that take a minute to compile: they
/// are in one translation unit.

#include <openvdb/Grid.h>

#include "esvr/nano_volume.h"
#include "vdb/nano_io.h"

namespace esvr::vdb {

using NanoHandle = nanovdb::GridHandle<nanovdb::HostBuffer>;

struct NanoForm {
  NanoValues values = NanoValues::kFloat;
  float tolerance = -1.0f;  ///< kFpN: largest error in value units; below 0: NanoVDB's own choice
};

/// A grid of floats in the form given, or one of doubles as doubles. Without dithering.
/// \throws std::logic_error  a grid of another type; doubles in another form than kFloat
[[nodiscard]] NanoHandle makeNano(const openvdb::GridBase& grid, const NanoForm& form = {});

}  // namespace esvr::vdb
