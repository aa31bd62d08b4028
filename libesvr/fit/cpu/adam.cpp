#include "fit/adam.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "fit/adam_math.h"

namespace esvr {

void adamStep(std::span<Ellipsoid> ellipsoids, std::span<AdamState> states,
              std::span<const EllipsoidGradient> gradients, const StepSizes& sizes,
              const AdamOptions& options, const EllipsoidLimits& limits) {
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(0, ellipsoids.size(), 64), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const ParameterVector largest = largestStep(ellipsoids[i], sizes);
      const ParameterVector step =
          adamDirection(states[i], gradients[i].byParameter, options, largest);
      moveWithin(ellipsoids[i], step, limits);
    }
  });
}

}  // namespace esvr
