#include "vdb2esvr/byte_shares.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "esvr/error.h"

namespace esvr::vdb2esvr {
namespace {

std::optional<std::uint64_t> sizeOf(const Options& options, const VdbSummary& input) {
  if (options.size) return options.size;
  if (!options.ratio) return std::nullopt;
  return std::uint64_t(double(input.fileBytes) / *options.ratio);
}

/// The weight of a grid in the division, which is above 0 for empty grids.
double weightOf(const GridSummary& grid) { return double(grid.activeVoxels) + 1.0; }

}  // namespace

ByteShares::ByteShares(const Options& options, const VdbSummary& input,
                       const std::vector<GridSummary>& grids)
    : left_(sizeOf(options, input)) {
  for (const auto& grid : grids) voxelsLeft_ += weightOf(grid);
  if (!left_) return;
  const std::uint64_t fixed = bytesBesideGrids(input.metadata);
  if (fixed >= *left_)
    throw UsageError("the file takes " + std::to_string(fixed) +
                     " bytes without any grid; the size allows " + std::to_string(*left_));
  *left_ -= fixed;
}

std::optional<std::uint64_t> ByteShares::of(const GridSummary& grid) const {
  if (!left_) return std::nullopt;
  return std::uint64_t(double(*left_) * weightOf(grid) / voxelsLeft_);
}

void ByteShares::take(const GridSummary& grid, const StoredGrid& stored) {
  voxelsLeft_ -= weightOf(grid);
  if (!left_) return;
  *left_ -= std::min(*left_, bytesAdded(stored));
}

}  // namespace esvr::vdb2esvr
