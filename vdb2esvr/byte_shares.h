#pragma once
/// Divides the wanted size of a file among its grids.

#include <cstdint>
#include <optional>
#include <vector>

#include "esvr/container.h"
#include "esvr/vdb_io.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

/// Grids share the bytes by their active voxels. Bytes that a grid does not use go to later grids.
class ByteShares {
 public:
  ByteShares(const Options& options, const VdbSummary& input,
             const std::vector<GridSummary>& grids);

  /// Bytes for the next grid; nothing if no size is wanted.
  [[nodiscard]] std::optional<std::uint64_t> of(const GridSummary& grid) const;

  /// Subtracts the bytes of a converted grid.
  void take(const GridSummary& grid, const StoredGrid& stored);

 private:
  std::optional<std::uint64_t> left_;
  double voxelsLeft_ = 0.0;
};

}  // namespace esvr::vdb2esvr
