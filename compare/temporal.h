#pragma once
/// Compares the change of grids from one frame of a sequence to the next.

#include <map>
#include <optional>
#include <string>

#include "compare/check_options.h"
#include "esvr/sparse_volume.h"

namespace esvr::compare {

/// The volumes of a grid in the two files, and its peak in the reference.
struct ComparedVolumes {
  const SparseVolume& reference;
  const SparseVolume& candidate;
  double peak = 0.0;
};

/// Keeps the volumes of two frames at most.
class TemporalComparison {
 public:
  explicit TemporalComparison(const CheckOptions& options) : options_(options) {}

  /// Begins the next frame.
  void beginFrame();

  /// The PSNR of the temporal difference of a grid, dB, with the larger one of the peaks of the two
  /// frames; nothing if the frame before did not have the grid with an active voxel.
  [[nodiscard]] std::optional<double> compare(const std::string& grid,
                                              const ComparedVolumes& volumes);

 private:
  struct Volumes {
    SparseVolume reference, candidate;
    double peak = 0.0;
  };
  const CheckOptions& options_;
  std::map<std::string, Volumes> before_, current_;  ///< by the name of the grid
};

}  // namespace esvr::compare
