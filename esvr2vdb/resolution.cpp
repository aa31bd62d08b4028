// The resolution of the written grids (--coarsen, --voxel-size).
#include "esvr/resolution.h"

#include <algorithm>
#include <array>
#include <string>

#include "esvr/error.h"
#include "esvr2vdb/jobs.h"

namespace esvr::esvr2vdb {
namespace {

constexpr std::array kFactors{1, 2, 4, 8};

/// Bytes of all grids in memory, which are there twice more while they are written, and of the work.
double bytesOf(std::span<const StoredGrid* const> grids, int factor, const DecodeOptions& decode) {
  constexpr double kCopies = 3.0;
  double bytes = 0.0, work = 0.0;
  for (const StoredGrid* grid : grids) {
    const ResolutionBytes needed = bytesAtResolution(*grid, factor, decode);
    bytes += kCopies * double(needed.result);
    work = std::max(work, double(needed.work));
  }
  return bytes + work;
}

}  // namespace

bool changesResolution(const Options& options) {
  const Resolution& wish = options.resolution;
  return wish.isAuto || wish.voxelSize || wish.factor != 1.0;
}

Resolution resolved(const Resolution& wish, std::span<const StoredGrid* const> grids,
                    const DecodeOptions& decode, const cli::Log& log) {
  if (!wish.isAuto) return wish;
  for (const int factor : kFactors) {
    const double bytes = bytesOf(grids, factor, decode);
    if (factor == kFactors.back())
      requireWithinMemory(bytes, decode.maxBytes,
                          "decoding the grids with voxels 8 times as large");
    if (bytes > double(decode.maxBytes)) continue;
    if (factor > 1)
      log.info("--coarsen auto: voxels become " + std::to_string(factor) +
               " times as large along each axis, so that the grids fit into the memory");
    return {.factor = double(factor)};
  }
  return wish;
}

double factorOf(const Resolution& wish, const GridDescriptor& grid) {
  try {
    const double factor = wish.voxelSize ? factorFor(grid.transform, *wish.voxelSize) : wish.factor;
    (void)transformAt(grid.transform, factor);
    return factor;
  } catch (const UsageError& refusal) {
    // The refusal knows the transform, and not the name of the grid.
    throw UsageError("grid '" + shownName(grid.name) + "': " + refusal.what());
  }
}

Resolution resolutionOf(const std::optional<std::string>& coarsen,
                        const std::optional<double>& voxelSize) {
  if (coarsen && voxelSize) throw UsageError("--coarsen and --voxel-size exclude each other");
  if (!coarsen) return {.voxelSize = voxelSize};
  if (*coarsen == "auto") return {.isAuto = true};
  for (const int factor : kFactors)
    if (factor > 1 && *coarsen == std::to_string(factor)) return {.factor = double(factor)};
  throw UsageError("--coarsen must be 2, 4, 8 or auto, not '" + *coarsen + "'");
}

}  // namespace esvr::esvr2vdb
