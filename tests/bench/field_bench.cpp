/// Benchmarks of the evaluation of fields on the CPU. items_per_second counts pairs of an ellipsoid
/// and a brick.

#include "bench/bench_scene.h"

namespace esvr {
namespace {

using bench::Scene;

/// The part that both devices need: gathering the ellipsoids and listing the pairs.
void planOfEvaluation(benchmark::State& state) {
  const Scene scene(std::size_t(state.range()));
  for (auto _ : state) benchmark::DoNotOptimize(planEvaluation(scene.field, scene.corners));
  countPairs(state, scene);
}
BENCHMARK(planOfEvaluation)->Arg(1000)->Arg(30000)->Unit(benchmark::kMillisecond)->UseRealTime();

void evaluateBricksOnCpu(benchmark::State& state) {
  Scene scene(std::size_t(state.range()));
  for (auto _ : state) evaluateBricks(scene.field, scene.corners, scene.values);
  countPairs(state, scene);
}
BENCHMARK(evaluateBricksOnCpu)->Arg(1000)->Arg(30000)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace esvr
