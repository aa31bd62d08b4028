#include "field/cuda/evaluate.h"

#include <stdexcept>

#include "core/cuda/stream.h"
#include "core/cuda/use_device.h"
#include "esvr/cuda/field.h"
#include "field/cuda/evaluate_memory.h"
#include "field/cuda/evaluate_tuning.h"

namespace esvr {
namespace cuda {

void evaluateBricks(const Field& field, std::span<const Coord> corners, std::span<float> out,
                    cudaStream_t stream, std::size_t batchBytes) {
  const EvaluatePlan plan = planEvaluation(field, corners);
  const DeviceField onDevice(plan.field, stream);
  for (const Batch batch :
       splitIntoBatches(plan.pairs.brickBegin, DeviceBricks::kCost, batchBytes)) {
    DeviceBricks bricks(plan.pairs, corners, batch, stream);
    launchEvaluate(evaluateArguments(onDevice, bricks, field.background), stream);
    bricks.values.download(out.subspan(batch.begin * kBrickVoxels, bricks.values.size()));
  }
}

}  // namespace cuda

void evaluateBricksCuda(const Field& field, std::span<const Coord> corners, std::span<float> out,
                        const Device& device) {
  if (out.size() != corners.size() * kBrickVoxels)
    throw std::logic_error("evaluateBricksCuda: room for another number of bricks");
  cuda::useDevice(device);
  const cuda::Stream stream;
  cuda::evaluateBricks(field, corners, out, stream.get(), cuda::EvaluateTuning::kBatchBytes);
}

}  // namespace esvr
