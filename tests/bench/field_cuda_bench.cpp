/// Evaluation of fields on CUDA: the whole call, and the kernel alone.

#include <optional>
#include <string>

#include "bench/bench_scene.h"
#include "core/cuda/stream.h"
#include "core/cuda/use_device.h"
#include "esvr/cuda/field.h"
#include "field/cuda/evaluate_memory.h"

namespace esvr::cuda {
namespace {

using bench::Scene;

/// Nothing, and the benchmark marked as failed, where there is no device.
std::optional<Device> deviceOf(benchmark::State& state) {
  try {
    const Device device = selectDevice("cuda");
    useDevice(device);
    return device;
  } catch (const DeviceError& error) {
    state.SkipWithError(error.what());
    return std::nullopt;
  }
}

class Event {
 public:
  Event() { check(cudaEventCreate(&event_), "making an event"); }
  ~Event() { cudaEventDestroy(event_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  void record(const Stream& stream) { check(cudaEventRecord(event_, stream.get()), "an event"); }
  double secondsSince(const Event& earlier) const {
    float milliseconds = 0.0f;
    check(cudaEventSynchronize(event_), "waiting for an event");
    check(cudaEventElapsedTime(&milliseconds, earlier.event_, event_), "timing");
    return milliseconds * 1e-3;
  }

 private:
  cudaEvent_t event_ = nullptr;
};

void evaluateBricksOnCuda(benchmark::State& state) {
  const auto device = deviceOf(state);
  if (!device) return;
  Scene scene(std::size_t(state.range()));
  for (auto _ : state) evaluateBricksCuda(scene.field, scene.corners, scene.values, *device);
  countPairs(state, scene);
}
BENCHMARK(evaluateBricksOnCuda)
    ->Arg(1000)
    ->Arg(30000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void evaluateKernelOnCuda(benchmark::State& state) {
  if (!deviceOf(state)) return;
  const Scene scene(std::size_t(state.range()));
  const EvaluatePlan plan = planEvaluation(scene.field, scene.corners);
  const Stream stream;
  const DeviceField field(plan.field, stream.get());
  DeviceBricks bricks(plan.pairs, scene.corners, {0, scene.corners.size()}, stream.get());
  Event begin, end;
  for (auto _ : state) {
    begin.record(stream);
    launchEvaluate(evaluateArguments(field, bricks, scene.field.background), stream.get());
    end.record(stream);
    state.SetIterationTime(end.secondsSince(begin));
  }
  countPairs(state, scene);
}
BENCHMARK(evaluateKernelOnCuda)
    ->Arg(1000)
    ->Arg(30000)
    ->Unit(benchmark::kMillisecond)
    ->UseManualTime();

}  // namespace
}  // namespace esvr::cuda
