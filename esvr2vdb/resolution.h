#pragma once
/// The resolution of the written grids (--coarsen, --voxel-size).

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <variant>

#include "esvr/grid_coding.h"
#include "esvr/resolution.h"
#include "esvr2vdb/jobs.h"

namespace esvr::esvr2vdb {

/// True if grids may be written with other voxels than those of the source.
[[nodiscard]] bool changesResolution(const Options& options);

/// What `auto` becomes for these grids: the least factor of 1, 2, 4 and 8 with which all of them fit into the memory. Says
/// so if it is above 1. Another wish is returned as it is.
/// \param grids   components of vectors are grids of their own
/// \throws MemoryExceeded  the coarsest grids do not fit either
[[nodiscard]] Resolution resolved(const Resolution& wish, std::span<const StoredGrid* const> grids,
                                  const DecodeOptions& decode, const cli::Log& log);

/// The factor of the voxels of a grid. `auto` must be resolved.
/// \throws UsageError  as for factorFor
[[nodiscard]] double factorOf(const Resolution& wish, const GridDescriptor& grid);

/// For --coarsen. \throws UsageError  the text is no factor
[[nodiscard]] Resolution resolutionOf(const std::optional<std::string>& coarsen,
                                      const std::optional<double>& voxelSize);

}  // namespace esvr::esvr2vdb
