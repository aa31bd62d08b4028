#pragma once
/// Runs an optimiser to what the user asked for.

#include <cstdint>
#include <optional>

#include "fit/recorder.h"
#include "fit/schedule.h"

namespace esvr {

/// What a run is to reach, every choice made.
struct RunPlan {
  std::size_t count = 0;         ///< ellipsoids at the end of growth
  std::uint32_t iterations = 0;  ///< length of the schedule
  std::optional<double> psnr;    ///< dB over the box: the run ends as soon as it is reached
  std::optional<double>
      seconds;              ///< since the recorder's start; replaces `iterations` as the clock
  bool learnKappa = false;  ///< else the kernel stays as it is
};

struct RunEnd {
  FitEnd end;
  std::uint32_t iterations;  ///< that were done
};

RunEnd run(Optimiser& optimiser, const FitTarget& target, Recorder& recorder, const RunPlan& plan,
           const Tuning& tuning);

}  // namespace esvr
