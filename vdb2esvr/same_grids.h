#pragma once
/// Compares the grids of two frames.

#include "esvr/container.h"

namespace esvr::vdb2esvr {

/// True if two frames have the same grids in the same order, which agree in name, type, class and
/// transform, so that a frame can refer to the one before it. Voxels and metadata may differ.
[[nodiscard]] bool haveSameGrids(const EsvrFile& a, const EsvrFile& b);

}  // namespace esvr::vdb2esvr
