#pragma once
/// Reads the grids that are fitted.

#include <vector>

#include "esvr/vdb_io.h"
#include "vdb2esvr/choose_grids.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

/// Reads a grid of numbers or a component of a grid of vectors.
/// \throws  as for readGrid and readComponent
[[nodiscard]] VolumeGrid readSource(const Options& options, const FittedGrid& grid);

/// Sets the peak and the range of all components of vectors to peakOfVectors() and
/// valueRangeOfVectors(), for which the vectors are read. \throws  as for readVector
void findScales(const Options& options, std::vector<FittedGrid>& grids);

}  // namespace esvr::vdb2esvr
