#pragma once
/// A part of a fit in chunks: the fit of one chunk in one round.

#include <array>
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
#include "fit/chunks/divide.h"
#include "fit/run.h"

namespace esvr {

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

}  // namespace esvr
