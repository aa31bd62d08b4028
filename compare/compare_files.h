#pragma once
/// Compares the grids of two files.

#include <map>
#include <optional>
#include <string>

#include "compare/check.h"
#include "compare/grid_file.h"
#include "esvr/device.h"
#include "esvr/volume.h"

namespace esvr::compare {

/// The volumes of a grid in the two files, and its peak in the reference.
struct ComparedVolumes {
  const SparseVolume& reference;
  const SparseVolume& candidate;
  double peak = 0.0;
};

/// Compares the change of grids from one frame of a sequence to the next. It keeps the volumes of
/// two frames at most.
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

struct FilePair {
  const GridFile& reference;
  const GridFile& candidate;
  const CancelToken& cancel;
};

/// Compares the grids that the options name, and judges limits and differences.
/// \param temporal  compares with the frame before, if the files are frames of sequences; else null
/// \throws BadInput  the files cannot be compared
/// \throws Cancelled
[[nodiscard]] CheckRecord compareFiles(const CheckOptions& options, const FilePair& files,
                                       TemporalComparison* temporal);

}  // namespace esvr::compare
