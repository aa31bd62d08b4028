#include "field/brick_evaluator.h"

#include "core/parallel.h"
#include "esvr/sparse_volume.h"
#include "field/brick_kernels.h"
#include "field/evaluate_plan.h"

namespace esvr {

BrickEvaluator::BrickEvaluator(const PreparedField& field, std::span<const Coord> corners)
    : field_(field), corners_(corners), pairs_(pairsWith(field.reach, corners)) {}

void BrickEvaluator::evaluateBrick(std::size_t brick, float* sum) const {
  const BrickKernels& kernels = brickKernels();
  const GatheredField& gathered = field_.gathered;
  for (auto pair = pairs_.brickBegin[brick]; pair != pairs_.brickBegin[brick + 1]; ++pair) {
    const auto i = pairs_.ellipsoid[pair];
    const auto corner = gathered.fromOrigin(i, corners_[brick]);
    kernels.add(gathered.forms[i], corner.data(), gathered.kernel(i), sum);
  }
}

void BrickEvaluator::evaluate(std::size_t first, std::span<float> out) const {
  parallelFor(std::size_t(0), out.size() / kBrickVoxels, [&](std::size_t b) {
    alignas(64) float sum[kBrickVoxels] = {};
    evaluateBrick(first + b, sum);
    for (std::size_t v = 0; v < kBrickVoxels; ++v)
      out[b * kBrickVoxels + v] = field_.background + sum[v];
  });
}

}  // namespace esvr
