#pragma once
/// A part of a fit in chunks: the fit of one chunk in one round.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "esvr/fit.h"
#include "esvr/part_runner.h"
#include "fit/chunks/chunk_target.h"
#include "fit/chunks/device_turns.h"
#include "fit/chunks/divide_bricks.h"
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

/// A fit in chunks, as far as it does not change with the rounds.
struct FitScene : ChunkScene {
  const FitOptions& options;
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
