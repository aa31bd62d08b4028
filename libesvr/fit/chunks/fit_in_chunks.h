#pragma once
/// Fits a volume chunk by chunk (docs/scale.md).

#include <chrono>
#include <functional>
#include <mutex>
#include <span>
#include <vector>

#include "esvr/fit.h"
#include "fit/chunks/part.h"

namespace esvr {

/// Fits all chunks in rounds, in which the ellipsoids of the other chunks are constants. The result
/// does not depend on where and in which order options.parts runs the parts of a round.
/// \param scale   scaleOf(volume)
/// \param chunks  at least two
[[nodiscard]] FitResult fitInChunks(const SparseVolume& volume, const FitOptions& options,
                                    const TargetScale& scale, std::span<const BrickChunk> chunks);

/// Progress of a fit in chunks, from the reports of its parts, which may run on several threads.
class WholeProgress {
 public:
  /// \param report  gets the progress of the whole fit; may be empty
  WholeProgress(const FitScene& scene, std::function<void(const FitProgress&)> report);

  /// A function for the reports of a chunk's part; empty if nobody asks for reports.
  [[nodiscard]] std::function<void(const FitProgress&)> of(std::size_t chunk);

  /// A part has ended, which is reported. \param fraction  share of the schedule at its end
  void end(std::size_t chunk, const PartEnd& part, double fraction);

  /// A chunk's share of the active voxels.
  [[nodiscard]] double shareOf(std::size_t chunk) const { return chunks_[chunk].share; }

  /// Seconds since the fit began.
  [[nodiscard]] double seconds() const;

 private:
  struct Chunk {
    double share = 0.0;      ///< share of the active voxels
    double boxVoxels = 0.0;  ///< voxels of its part of the box
    double fraction = 0.0;   ///< share of its schedule that is done
    double squares = 0.0;    ///< sum of squares over its part of the box, relative to the peak
    std::size_t ellipsoids = 0;
  };
  [[nodiscard]] FitProgress whole() const;

  std::function<void(const FitProgress&)> report_;
  double boxVoxels_;
  std::uint64_t activeVoxels_ = 0;
  std::size_t partsDone_ = 0;
  std::mutex mutex_;
  std::vector<Chunk> chunks_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace esvr
