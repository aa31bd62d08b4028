#include "field/brick_batches.h"

#include <algorithm>
#include <functional>
#include <vector>

#include "core/parallel.h"
#include "field/brick_evaluator.h"
#include "field/count_bricks.h"

namespace esvr {
namespace {

Box boundsOf(std::span<const Coord> corners) {
  Box bounds;
  for (const Coord corner : corners) bounds.expand(brickOf(corner));
  return bounds;
}

/// An upper bound of the number of pairs with these bricks.
double maxPairs(std::span<const Support> reach, std::span<const Coord> corners) {
  using Range = tbb::blocked_range<std::size_t>;
  const Box bounds = boundsOf(corners);
  const double bricks = double(corners.size());
  return parallelDeterministicReduce(
      Range(0, reach.size(), 4096), 0.0,
      [&](const Range& range, double sum) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          sum += std::min(maxBricks(reach[i], bounds), bricks);
        return sum;
      },
      std::plus<>());
}

class Batches {
 public:
  Batches(const Field& field, std::size_t bricks, const BatchVisitor& visit, double maxListed)
      : field_(field),
        values_(std::min(kBatchBricks, bricks) * kBrickVoxels),
        visit_(visit),
        maxListed_(maxListed) {}

  /// Halves the bricks until their pairs can be listed.
  void visit(std::span<const Coord> corners) {
    if (corners.size() > 1 && maxPairs(field_.reach, corners) > maxListed_) {
      visit(corners.first(corners.size() / 2));
      return visit(corners.subspan(corners.size() / 2));
    }
    const BrickEvaluator evaluator(field_, corners);
    for (std::size_t first = 0; first < corners.size(); first += kBatchBricks) {
      const auto batch = corners.subspan(first, std::min(kBatchBricks, corners.size() - first));
      const auto sums = std::span(values_).first(batch.size() * kBrickVoxels);
      evaluator.evaluate(first, sums);
      visit_({batch, sums});
    }
  }

 private:
  PreparedField field_;
  std::vector<float> values_;
  const BatchVisitor& visit_;
  double maxListed_;
};

}  // namespace

void forEachBatch(const Field& field, std::span<const Coord> corners, const BatchVisitor& visit,
                  double maxListed) {
  if (!corners.empty()) Batches(field, corners.size(), visit, maxListed).visit(corners);
}

}  // namespace esvr
