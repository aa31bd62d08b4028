#pragma once
/// Divides the wanted size of a file among its grids.

#include <cstdint>
#include <optional>
#include <vector>

#include "esvr/container.h"
#include "esvr/vdb_io.h"
#include "vdb2esvr/choose_grids.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/twins.h"

namespace esvr::vdb2esvr {

/// Every grid gets the few bytes that the smallest one takes, and grids share the others by their
/// active voxels. A frame of a sequence without active voxels has no size to keep to. Bytes that a grid
/// does not use go to those that are converted after it. Twins of a grid have no share; the bytes of their
/// records are reserved.
class ByteShares {
 public:
  /// \param carried  grids that the file holds unchanged
  /// \throws UsageError  the size has no room for what the file holds besides the fitted grids
  ByteShares(const Options& options, const VdbSummary& input, const std::vector<FittedGrid>& grids,
             const Twins& twins, const std::vector<CarriedGrid>& carried);

  /// Bytes for a grid without its twins; nothing if no size is wanted.
  [[nodiscard]] std::optional<std::uint64_t> of(std::size_t grid) const;

  /// Subtracts the bytes of a converted grid and of its twins.
  /// \param previous  the same grid of the previous frame, from which it is predicted; null: none
  /// \return the bytes by which they exceed their share; if there are any, nothing is subtracted
  [[nodiscard]] std::uint64_t take(std::size_t grid, const StoredGrid& stored,
                                   const StoredGrid* previous);

 private:
  /// A grid that is not a twin.
  struct Share {
    double weight = 0.0;
    std::vector<GridDescriptor> twins;
    std::uint64_t reserved = 0;  ///< expected bytes of the twins
  };

  void reserve(const Twin& twin);
  /// Bytes of a converted grid with its twins.
  [[nodiscard]] static std::uint64_t bytesOf(const Share& share, const StoredGrid& stored,
                                             const StoredGrid* previous);

  std::optional<std::uint64_t> left_;  ///< bytes without those reserved
  double weightLeft_ = 0.0;
  std::uint64_t gridsLeft_ = 0;  ///< that have no bytes yet
  std::uint64_t least_ = 0;      ///< bytes that every grid gets
  std::vector<Share> shares_;    ///< one for each grid; that of a twin is not used
};

}  // namespace esvr::vdb2esvr
