#include "field/cuda/batches.h"

namespace esvr::cuda {

std::vector<Batch> splitIntoBatches(std::span<const std::uint32_t> brickBegin, BrickCost cost,
                                    std::size_t bound) {
  std::vector<Batch> batches;
  std::size_t used = 0;
  for (std::size_t b = 0; b + 1 < brickBegin.size(); ++b) {
    const std::size_t pairs = brickBegin[b + 1] - brickBegin[b];
    const std::size_t bytes = cost.perBrick + pairs * cost.perPair;
    if (batches.empty() || used + bytes > bound) {
      batches.push_back({b, b});
      used = 0;
    }
    batches.back().end = b + 1;
    used += bytes;
  }
  return batches;
}

}  // namespace esvr::cuda
