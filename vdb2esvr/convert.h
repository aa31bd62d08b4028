#pragma once
/// One grid on its way from the input to what the file holds, with all that is told of it.

#include <cstdint>
#include <optional>
#include <string>

#include "esvr/convert.h"
#include "esvr/metrics.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

struct PhaseSeconds {
  double read = 0.0, seed = 0.0, optimise = 0.0, encode = 0.0, measure = 0.0;
  [[nodiscard]] double fit() const { return seed + optimise; }
  [[nodiscard]] double total() const { return read + seed + optimise + encode + measure; }
};

struct ConvertedGrid {
  std::string uniqueName;  ///< in the input
  Conversion conversion;
  VolumeMetrics metrics;   ///< of the voxels that the stored grid gives back
  std::size_t bricks = 0;  ///< of the source
  std::uint64_t nonFiniteReplaced = 0;
  std::string device;                       ///< that fitted it
  std::optional<double> hits;               ///< averageHits, where it was asked for
  std::optional<std::uint64_t> voxelPairs;  ///< countHits in the source's bricks, likewise
  std::optional<PaperRecord> paper;         ///< where the paper's method was asked for
  PhaseSeconds seconds;

  [[nodiscard]] const StoredGrid& stored() const { return conversion.grid; }
};

/// Reads, converts and measures a grid. The fit's progress and cancellation are those of
/// `options.convert.fit`.
/// \param bytes  that the grid may add to the file, where a size was asked for
[[nodiscard]] ConvertedGrid convertGrid(const Options& options, const std::string& uniqueName,
                                        std::optional<std::uint64_t> bytes);

}  // namespace esvr::vdb2esvr
