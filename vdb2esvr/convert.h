#pragma once
/// One grid's way from voxels to what the file holds.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/fit.h"
#include "esvr/metrics.h"
#include "esvr/quantised.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

struct PhaseSeconds {
  double read = 0.0, seed = 0.0, optimise = 0.0, encode = 0.0, measure = 0.0;
  [[nodiscard]] double fit() const { return seed + optimise; }
  [[nodiscard]] double total() const { return read + seed + optimise + encode + measure; }
};

/// What quantising the ellipsoids did.
struct CompactRecord {
  double loss = 0.0;  ///< dB over the box, against float32
  QuantiserSteps steps;
  StreamBytes bytes;
};

/// What a bound on the error took.
struct BoundRecord {
  std::uint64_t voxelBytes = 0;      ///< of the grid with its voxels alone
  std::uint64_t ellipsoidBytes = 0;  ///< of the smallest with ellipsoids that was tried; 0: none
};

struct ConvertedGrid {
  std::string uniqueName;  ///< in the input
  StoredGrid stored;       ///< as a reader of the file will get it
  VolumeMetrics metrics;   ///< of the voxels that it gives back
  std::size_t bricks = 0;  ///< of the source
  std::uint64_t nonFiniteReplaced = 0;
  FitEnd end = FitEnd::kScheduleDone;
  bool kappaLearned = false;
  std::string device;           ///< that fitted it
  std::size_t deviceBytes = 0;  ///< FitResult::deviceBytes
  std::uint64_t pairs = 0;
  bool signedIntensities = false;
  std::optional<double> hits;               ///< averageHits, where it was asked for
  std::optional<std::uint64_t> voxelPairs;  ///< countHits in the source's bricks, likewise
  std::optional<PaperRecord> paper;         ///< FitResult::paper
  std::vector<TimedCurvePoint> curve;       ///< of the fit, whether the file has it or not
  std::optional<BoundRecord> bound;
  std::optional<CompactRecord> compact;  ///< nothing where float32 is stored
  PhaseSeconds seconds;
};

/// Reads, fits, encodes and measures a grid. The fit's progress and cancellation are those of
/// `options.fit`.
/// \param bytes  that the grid may add to the file, where a size was asked for
[[nodiscard]] ConvertedGrid convertGrid(const Options& options, const std::string& uniqueName,
                                        std::optional<std::uint64_t> bytes);

}  // namespace esvr::vdb2esvr
