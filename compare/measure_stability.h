#pragma once
/// Measures the stability of the grids of a file.

#include <vector>

#include "compare/grid_file.h"
#include "compare/stability_options.h"
#include "compare/stability_record.h"
#include "esvr/device.h"
#include "esvr/progress.h"

namespace esvr::compare {

/// Measures on one device after the other.
struct StabilityRun {
  const StabilityRequest& request;
  const std::vector<Device>& devices;
  const CancelToken& cancel;
};

/// The grids of a file that the request names, in the order of the file.
/// \throws BadInput  the file is no .esvr file, or has no grid of a name
/// \throws MemoryExceeded  the bricks of a grid take more memory than allowed
/// \throws Cancelled
[[nodiscard]] std::vector<GridStability> measureFile(const StabilityRun& run, const GridFile& file);

}  // namespace esvr::compare
