#pragma once
/// The scene that the benchmarks of field/ measure.

#include <benchmark/benchmark.h>

#include <string>
#include <vector>

#include "esvr/field.h"
#include "field/evaluate_plan.h"
#include "field/random_field.h"

namespace esvr::bench {

/// A random field that is as dense as fits of thin structures, and all bricks that it reaches.
struct Scene {
  explicit Scene(std::size_t ellipsoids)
      : field(test::randomField({.count = ellipsoids, .extent = 256, .smallest = 0.7})),
        corners(reachedBricks(field)),
        values(corners.size() * kBrickVoxels) {}

  Field field;
  std::vector<Coord> corners;
  std::vector<float> values;
};

/// Reports the pairs of an ellipsoid and a brick per second.
inline void countPairs(benchmark::State& state, const Scene& scene) {
  const auto pairs = planEvaluation(scene.field, scene.corners).pairs.pairCount();
  state.SetItemsProcessed(state.iterations() * std::int64_t(pairs));
  state.SetLabel(std::to_string(pairs) + " pairs, " + std::to_string(scene.corners.size()) +
                 " bricks");
}

}  // namespace esvr::bench
