#pragma once
/// How the sum of a stored grid is measured (esvr/stability.h).

#include "esvr/container.h"
#include "esvr/stability.h"

namespace esvr::cli {

/// Samples are taken from the bricks that a reader evaluates, and values are clamped as a reader
/// clamps them. The options refer to the bricks of `grid`.
/// \param samples  number of bricks
[[nodiscard]] StabilityOptions stabilityOptionsOf(const StoredGrid& grid, std::size_t samples);

/// The peak of a grid's source (peakOf, sparse_volume.h), to which differences are compared.
[[nodiscard]] double peakOfSource(const StoredGrid& grid);

}  // namespace esvr::cli
