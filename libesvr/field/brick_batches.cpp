#include "field/brick_batches.h"

#include <algorithm>
#include <vector>

#include "field/brick_evaluator.h"

namespace esvr {

void forEachBatch(const Field& field, std::span<const Coord> corners, const BatchVisitor& visit) {
  const BrickEvaluator evaluator(field, corners);
  std::vector<float> values(std::min(kBatchBricks, corners.size()) * kBrickVoxels);
  for (std::size_t first = 0; first < corners.size(); first += kBatchBricks) {
    const auto batch = corners.subspan(first, std::min(kBatchBricks, corners.size() - first));
    const auto sums = std::span(values).first(batch.size() * kBrickVoxels);
    evaluator.evaluate(first, sums);
    visit({batch, sums});
  }
}

}  // namespace esvr
