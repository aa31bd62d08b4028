#include "fit/adam.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace esvr {
namespace {

/// Intensities near zero still move: in units of the target, whose largest magnitude is 1.
constexpr double kIntensityFloor = 0.01;
constexpr double kEpsilon = 1e-30;  // gradients are of any size: only 0 / 0 is to be avoided

ParameterVector largestStep(const Primitive& p, const StepSizes& s) {
  const double i = s.intensity * std::max(std::abs(p.intensity), kIntensityFloor);
  return {s.position, s.position, s.position, s.shape, s.shape,
          s.shape,    s.shape,    s.shape,    s.shape, i};
}

ParameterVector direction(AdamState& state, const ParameterVector& gradient, const AdamOptions& o) {
  ++state.steps;
  const double c1 = 1.0 / (1.0 - std::pow(o.beta1, state.steps));
  const double c2 = 1.0 / (1.0 - std::pow(o.beta2, state.steps));
  ParameterVector d;
  for (int k = 0; k < kParameters; ++k) {
    const double g = gradient[k];
    state.m[k] = float(o.beta1 * state.m[k] + (1.0 - o.beta1) * g);
    state.v[k] = float(o.beta2 * state.v[k] + (1.0 - o.beta2) * g * g);
    d[k] = -c1 * state.m[k] / (std::sqrt(c2 * state.v[k]) + kEpsilon);
  }
  return d;
}

void move(Primitive& p, AdamState& state, const PrimitiveGradient& g, const StepSizes& sizes,
          const AdamOptions& options) {
  ParameterVector step = direction(state, g.byParameter, options);
  const ParameterVector largest = largestStep(p, sizes);
  for (int k = 0; k < kParameters; ++k) step[k] *= largest[k];
  applyStep(p, step);
}

}  // namespace

void adamStep(std::span<Primitive> primitives, std::span<AdamState> states,
              std::span<const PrimitiveGradient> gradients, const StepSizes& sizes,
              const AdamOptions& options, const PrimitiveLimits& limits) {
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(0, primitives.size(), 64), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      Primitive& p = primitives[i];
      move(p, states[i], gradients[i], sizes, options);
      p.intensity = std::clamp(p.intensity, limits.lowestIntensity, limits.highestIntensity);
      clampScales(p, limits.smallestScale, limits.largestScale);
    }
  });
}

}  // namespace esvr
