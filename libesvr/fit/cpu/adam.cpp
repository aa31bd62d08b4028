#include "fit/adam.h"

#include "core/parallel.h"
#include "fit/adam_math.h"

namespace esvr {

void adamStep(std::span<Ellipsoid> ellipsoids, std::span<AdamState> states,
              std::span<const EllipsoidGradient> gradients, const AdamStep& step) {
  using Range = tbb::blocked_range<std::size_t>;
  parallelFor(Range(0, ellipsoids.size(), 64), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      Ellipsoid& p = ellipsoids[i];
      const ParameterVector largest = largestStep(p, step.sizes);
      moveWithin(p, adamDirection(states[i], gradients[i].byParameter, step.options, largest),
                 step.limits);
    }
  });
}

}  // namespace esvr
