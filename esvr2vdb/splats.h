#pragma once
/// The jobs of esvr2vdb that write splats and read them.

#include "esvr/container.h"
#include "esvr2vdb/jobs.h"
#include "programs/messages.h"

namespace esvr::esvr2vdb {

/// True if the output is a file of splats.
[[nodiscard]] bool writesSplats(const Options& options);

/// Writes a grid of a file as splats.
/// \throws BadInput  there is no such grid, or its ellipsoids cannot become splats (makeSplats)
/// \throws UsageError  several grids are named
void exportSplats(const Options& options, const EsvrFile& file, const cli::Log& log);

/// Writes a VDB with the density and the colors of the splats in the input.
void importSplats(const Options& options);

}  // namespace esvr::esvr2vdb
