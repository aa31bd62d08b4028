#pragma once
/// Runs an optimiser until the goal of the fit is reached.

#include <cstdint>
#include <optional>
#include <span>

#include "fit/recorder.h"
#include "fit/schedule.h"

namespace esvr {

/// The parameters of a run, with all defaults resolved.
struct RunPlan {
  std::size_t firstCount = 0;     ///< ellipsoids at the start of growth
  std::size_t count = 0;          ///< ellipsoids at the end of growth
  std::uint32_t iterations = 0;   ///< length of the schedule
  std::optional<double> psnr;     ///< dB over the box; the run ends as soon as it is reached
  std::optional<double> seconds;  ///< time limit; replaces `iterations` as length of the schedule
  FitState start{};               ///< ellipsoids to begin with; empty: seeds
  bool learnKappa = false;        ///< whether kappa is fitted or stays the same
  double from = 0.0, to = 1.0;    ///< the part of the schedule that is run
  bool curve = true;              ///< whether points of the curve are measured during the run
};

/// The number of seeds with which a fit of `count` ellipsoids begins.
[[nodiscard]] std::size_t firstSeeds(std::size_t count, const Tuning& tuning);

struct RunEnd {
  FitEnd end;
  std::uint32_t iterations;  ///< number of iterations done
};

RunEnd run(Optimiser& optimiser, const FitTarget& target, Recorder& recorder, const RunPlan& plan,
           const Tuning& tuning);

}  // namespace esvr
