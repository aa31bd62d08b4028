#pragma once
/// How the grids of a file share the bytes that it may have.

#include <cstdint>
#include <optional>
#include <vector>

#include "esvr/container.h"
#include "esvr/vdb_io.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

/// By active voxels; what one grid leaves goes to those after it.
class ByteShares {
 public:
  ByteShares(const Options& options, const VdbSummary& input,
             const std::vector<GridSummary>& grids);

  /// For a grid that comes next; nothing where no size was asked for.
  [[nodiscard]] std::optional<std::uint64_t> of(const GridSummary& grid) const;

  /// A grid has been encoded.
  void take(const GridSummary& grid, const StoredGrid& stored);

 private:
  std::optional<std::uint64_t> left_;
  double voxelsLeft_ = 0.0;
};

}  // namespace esvr::vdb2esvr
