#include "field/brick_batches.h"

#include <algorithm>
#include <vector>

#include "esvr/sparse_volume.h"
#include "field/brick_evaluator.h"

namespace esvr {
void forEachBrick(const Field& field, std::span<const Coord> corners, const BrickVisitor& visit) {
  const BrickEvaluator evaluator(field, corners);
  std::vector<float> values(std::min(kBatchBricks, corners.size()) * kBrickVoxels);
  for (std::size_t first = 0; first < corners.size(); first += kBatchBricks) {
    const auto batch = corners.subspan(first, std::min(kBatchBricks, corners.size() - first));
    evaluator.evaluate(first, std::span(values).first(batch.size() * kBrickVoxels));
    for (std::size_t b = 0; b < batch.size(); ++b)
      visit(batch[b], std::span(values).subspan(b * kBrickVoxels, kBrickVoxels));
  }
}

}  // namespace esvr
