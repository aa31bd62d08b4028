#pragma once
/// Lets the grids of a file share what they have in common.

#include <cstdint>
#include <vector>

#include "esvr/container.h"
#include "vdb2esvr/choose_grids.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/records.h"

namespace esvr::vdb2esvr {

/// Chooses for each grid of voxels another grid of the file that its voxels refer to, where that
/// takes fewer bytes, and gives the file the compact layout. If the goal is a PSNR, the voxels are
/// chosen again for this coding. The figures of the record become those of the new voxels.
/// \param fitted  the grids that were converted
/// \param file    the file of the record
void shareGrids(const Options& options, const std::vector<FittedGrid>& fitted, EsvrFile& file,
                RunRecord& record);

/// Bytes that the written file would take if its grids shared nothing but equal sections: each
/// section would have a row of the table, and each grid a record and voxels of its own.
[[nodiscard]] std::uint64_t bytesWithoutSharing(const EsvrFile& file, const RunRecord& record);

}  // namespace esvr::vdb2esvr
