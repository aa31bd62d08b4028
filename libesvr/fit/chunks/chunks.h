#pragma once
/// The parts of the fit of a volume that is too large for the device: its division into chunks, what is fitted for one chunk
/// in one round, and the fit of all of them, as a fit of the whole volume.

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "esvr/device.h"
#include "esvr/fit.h"
#include "esvr/volume.h"
#include "fit/run.h"

namespace esvr {

/// Bricks that are fitted together.
struct BrickChunk {
  /// Box of brick coordinates. The boxes of all chunks fill space without overlap, so that every
  /// point lies in one of them; those at the outside are unbounded.
  Box box;
  Box bounds;                         ///< the smallest box of brick coordinates of its bricks
  std::vector<std::uint32_t> bricks;  ///< numbers of its bricks, increasing; at least one
  std::uint64_t activeVoxels = 0;
};

/// Divides bricks by planes until no chunk has more than `maxBricks`, at least 1. Each plane halves
/// the bricks across the longest side of a chunk's bounds. Time and memory of a fit are proportional
/// to the bricks, so that chunks of as many bricks cost alike.
[[nodiscard]] std::vector<BrickChunk> divideBricks(const SparseVolume& volume,
                                                   std::size_t maxBricks);

/// A box that is larger by a number of bricks on all sides, as far as coordinates reach.
[[nodiscard]] Box dilated(const Box& box, int bricks);

/// The bricks around a chunk that its fit sees, wide enough for ellipsoids of twice the distance that
/// `count` of them have if they are spread evenly over the active voxels. Supports are limited to
/// this reach, because a fit would not see the error that an ellipsoid makes beyond it.
/// \return a number of bricks on each side
[[nodiscard]] int haloBricks(std::uint64_t activeVoxels, std::size_t count);

/// Numbers of the bricks of a chunk and of its halo, increasing.
/// \param chunks  all chunks of the volume
[[nodiscard]] std::vector<std::uint32_t> bricksAround(const SparseVolume& volume,
                                                      std::span<const BrickChunk> chunks,
                                                      const BrickChunk& chunk, int halo);

/// The chunks in which a volume is fitted: those of options.chunkVoxels, or the largest ones whose
/// fits stay within the memory of the GPU and within options.maxHostBytes.
/// \return no or one chunk if the volume needs no division
[[nodiscard]] std::vector<BrickChunk> chunksFor(const SparseVolume& volume,
                                                const FitOptions& options);

/// What is known of a chunk.
struct ChunkNeed {
  double error = 0.0;     ///< sum of squares with its present ellipsoids
  double count = 0.0;     ///< its present ellipsoids, or before the fit a number in proportion
  std::size_t least = 0;  ///< smallest number of ellipsoids
  std::size_t most = 0;   ///< largest number of ellipsoids
};

/// Divides `count` so that a further ellipsoid lowers the error of every chunk by the same amount,
/// within each chunk's limits. The error of a chunk is taken to fall by kDbPerDoubling where the
/// number of its ellipsoids doubles.
/// \return a number for each chunk; together `count`, if the limits allow it
[[nodiscard]] std::vector<std::size_t> dividedCount(std::size_t count,
                                                    std::span<const ChunkNeed> needs);

// ---- Parts

/// A fit in chunks has rounds. Each fits all chunks for a part of the schedule, from a fraction to
/// the next one.
inline constexpr std::array kRoundEnds{0.0, 0.1, 0.25, 0.5, 0.7, 0.85, 0.95, 1.0};
/// Kappa is fitted in the rounds that begin before this fraction of the schedule. In these rounds,
/// every chunk finds its own kappa. In later rounds, kappa is the same for all chunks and constant.
/// Up to 0.7, a tree of 197 million voxels in 32 chunks had 0.16 dB less; up to 0.25, `aneurism` in
/// four chunks had 0.5 dB less (docs/scale.md).
inline constexpr double kKappaUntil = 0.5;
inline constexpr int kRounds = int(kRoundEnds.size()) - 1;

/// The brick that contains the center of an ellipsoid.
[[nodiscard]] Coord brickWith(const Ellipsoid& p);

/// A fit in chunks, as far as it does not change with the rounds.
struct FitScene {
  const SparseVolume& volume;
  std::span<const BrickChunk> chunks;
  TargetScale scale;  ///< the units and the range of the whole volume, which all chunks share
  Box box;            ///< box of the PSNR, relative to the volume's origin
  int halo;           ///< see haloBricks()
  const FitOptions& options;
};

/// Ellipsoids that are not fitted but take part in the sum.
struct Ghosts {
  std::span<const Ellipsoid> ellipsoids;  ///< relative to the volume's origin, in its scaled units
  Kernel kernel;
};

/// The chunk's part of the box of the PSNR.
[[nodiscard]] Box boxOf(const FitScene& scene, const BrickChunk& chunk);

/// The target of a chunk's fit, which consists of the bricks of the chunk and of its halo. Its PSNR
/// counts the chunk's own part of the box. It is pinned, because the target points to the other
/// member.
struct ChunkTarget {
  ChunkTarget(const FitScene& scene, const BrickChunk& chunk, const Ghosts& ghosts);
  ChunkTarget(const ChunkTarget&) = delete;
  ChunkTarget& operator=(const ChunkTarget&) = delete;

  std::vector<BrickMask> counted;  ///< active voxels of the chunk's bricks; none of the halo's
  FitTarget target;
};

/// What the fit of a part begins with.
struct PartStart {
  std::size_t chunk = 0;
  Kernel kernel;
  RunPlan plan;                   ///< with the ellipsoids in the chunk and in its halo
  std::vector<Ellipsoid> ghosts;  ///< ellipsoids beyond the halo that reach into it
  FitErrors errors;               ///< errors at the end of the part before
  std::uint64_t pairs = 0;        ///< pairs at the end of the part before
};

/// What the fit of a part ends with.
struct PartEnd {
  FitState fit;             ///< the ellipsoids in the chunk
  Kernel kernel;            ///< with the kappa that the part has found
  FitErrors errors;         ///< errors of the chunk's part of the box
  std::uint64_t pairs = 0;  ///< pairs of ellipsoids and bricks, those in the halo included
  FitEnd end = FitEnd::kScheduleDone;
  std::uint32_t iterations = 0;  ///< iterations of the schedule up to the end of the part
  std::uint64_t deviceBytes = 0;
  bool deviceFull = false;
  double secondsSeed = 0.0;
};

/// Lets one part after the other use a GPU, so that another part can be prepared on the host
/// meanwhile. Any thread may use it. While it exists, the memory of GPUs that parts have freed is
/// kept for the next ones.
class DeviceTurns {
 public:
  using Turn = std::unique_lock<std::mutex>;

  /// Waits until no other part uses a GPU, until the turn is released. There is no waiting for the
  /// CPU, on which parts may run at the same time.
  [[nodiscard]] Turn take(const Device& device);

 private:
  struct Gpu {
    std::mutex inUse;
    std::shared_ptr<void> keptMemory;
  };

  std::mutex mutex_;
  std::map<int, Gpu> gpus_;  ///< by their numbers
};

/// Where a part is fitted.
struct PartPlace {
  const Device& device;
  DeviceTurns& turns;
  std::function<void(const FitProgress&)>
      progress{};  ///< gets the reports of the run; may be empty
};

/// Fits a part.
[[nodiscard]] PartEnd fitPart(const FitScene& scene, const PartStart& start,
                              const PartPlace& place);

/// The end of a part that was not fitted.
[[nodiscard]] PartEnd unchanged(const FitScene& scene, const PartStart& start);

/// A hash of all that the result of a part depends on, the voxels included.
[[nodiscard]] PartKey keyOf(const FitScene& scene, const PartStart& start);

/// The end of a part as bytes, for other processes of the same program.
[[nodiscard]] std::vector<std::byte> bytesOf(const PartEnd& end);

/// \throws BadInput  the bytes are not those of a part
[[nodiscard]] PartEnd partOf(std::span<const std::byte> bytes);

// ---- The fit of all chunks

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
