#pragma once
/// The tuned constants of a fit, which are the same for all data, and the schedule of growth,
/// relocation and step sizes that follows from them. docs/lab-notes.md, "The fit", has what was
/// tried instead.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "fit/adam.h"
#include "fit/motion_bound.h"

namespace esvr {

struct Tuning {
  StepSizes steps;
  AdamOptions adam;
  double smallestScale = 0.2;   ///< voxels; a support then spans a voxel, and no gaps show
  double largestScale = 16.0;   ///< voxels; larger scales take time and do not reduce the error
  double finalStep = 0.2;       ///< factor of the step sizes at the end of the decay
  double tail = 0.15;           ///< last fraction of the run, in which step sizes go to zero
  double firstShare = 0.1;      ///< share of the ellipsoids that are seeded at the start
  double growUntil = 0.5;       ///< fraction of the run at which growth ends
  double relocateUntil = 0.7;   ///< fraction of the run at which relocation ends
  double relocateShare = 0.05;  ///< share of the ellipsoids that an event relocates
  double eventEvery = 0.01;     ///< fraction of the run between events
  int eventSpacing = 15;        ///< smallest number of iterations between events
  int graceSteps = 14;          ///< steps of a new ellipsoid before it can be relocated
  float firstKappa = 0.5f;      ///< initial kappa if it is fitted
  double kappaStep = 0.1;       ///< largest change of kappa by an event
  double seedIntensity = 1.0;   ///< intensity of a seed, relative to the residual
  double seedWindow = 0.35;     ///< half width of a seed's window, relative to the seeds' spacing
  double intensityHeadroom = 1.5;  ///< limit of intensities, relative to the target's range
  SlackRule slack;                 ///< decides when pair lists are rebuilt
  int warmUp = 20;                 ///< iterations in which step sizes rise to their full size

  /// The constants for a number of iterations. Short runs gain 0.9 to 2.0 dB by shorter averages of
  /// the gradient and more frequent events; from 500 iterations on, both are equal
  /// (docs/lab-notes.md, "Short fits").
  [[nodiscard]] static Tuning forRun(std::uint32_t iterations) {
    Tuning tuning;
    if (iterations > kShortRun) return tuning;
    tuning.adam = {.beta1 = 0.75, .beta2 = 0.85};
    tuning.eventSpacing = 8;
    tuning.growUntil = 0.4;
    tuning.finalStep = 0.5;
    return tuning;
  }
  static constexpr std::uint32_t kShortRun = 200;
};

/// The schedule, as functions of the fraction of a run. The run grows from `from` to `to`
/// ellipsoids and has a length of `iterations`.
struct Schedule {
  std::size_t from = 0, to = 0;
  std::uint32_t iterations = 0;
  const Tuning& tuning;

  /// The number of ellipsoids, which grows linearly until Tuning::growUntil.
  [[nodiscard]] std::size_t countAt(double fraction) const {
    const double share = std::min(1.0, fraction / tuning.growUntil);
    return from + std::size_t(std::llround(share * double(to - from)));
  }
  /// The factor of the step sizes. It rises in the warm-up, decays exponentially, and goes to zero
  /// at the end, so that the steps leave no noise.
  [[nodiscard]] double stepAt(double fraction, std::uint32_t iteration) const {
    const double warm = std::min(1.0, double(iteration + 1) / tuning.warmUp);
    const double tail = std::min(1.0, (1.0 - fraction) / tuning.tail);
    return warm * tail * std::pow(tuning.finalStep, fraction);
  }
  [[nodiscard]] std::uint32_t eventInterval() const {
    const auto share = std::uint32_t(tuning.eventEvery * iterations);
    return std::max(share, std::uint32_t(tuning.eventSpacing));
  }
  [[nodiscard]] std::size_t relocationsAt(double fraction, std::size_t ellipsoids) const {
    if (fraction >= tuning.relocateUntil) return 0;
    return std::size_t(tuning.relocateShare * double(ellipsoids));
  }
};

}  // namespace esvr
