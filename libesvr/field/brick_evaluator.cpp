#include "field/brick_evaluator.h"

#include <tbb/parallel_for.h>

#include "esvr/sparse_volume.h"
#include "field/brick_kernels.h"

namespace esvr {

BrickEvaluator::BrickEvaluator(const Field& field, std::span<const Coord> corners)
    : corners_(corners), background_(field.background), plan_(planEvaluation(field, corners)) {}

void BrickEvaluator::evaluateBrick(std::size_t brick, float* sum) const {
  const BrickKernels& kernels = brickKernels();
  const auto& [gathered, pairs] = plan_;
  for (auto pair = pairs.brickBegin[brick]; pair != pairs.brickBegin[brick + 1]; ++pair) {
    const auto i = pairs.ellipsoid[pair];
    const auto corner = gathered.fromOrigin(i, corners_[brick]);
    kernels.add(gathered.forms[i], corner.data(), gathered.kernel(i), sum);
  }
}

void BrickEvaluator::evaluate(std::size_t first, std::span<float> out) const {
  tbb::parallel_for(std::size_t(0), out.size() / kBrickVoxels, [&](std::size_t b) {
    alignas(64) float sum[kBrickVoxels] = {};
    evaluateBrick(first + b, sum);
    for (std::size_t v = 0; v < kBrickVoxels; ++v) out[b * kBrickVoxels + v] = background_ + sum[v];
  });
}

}  // namespace esvr
