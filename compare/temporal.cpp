#include "compare/temporal.h"

#include <utility>

#include "esvr/temporal_metrics.h"

namespace esvr::compare {

void TemporalComparison::beginFrame() { before_ = std::exchange(current_, {}); }

std::optional<double> TemporalComparison::compare(const std::string& grid,
                                                  const SparseVolume& reference,
                                                  const SparseVolume& candidate) {
  current_[grid] = {reference, candidate};
  const auto before = before_.find(grid);
  if (before == before_.end()) return std::nullopt;
  return temporalPsnr({before->second.reference, reference}, {before->second.candidate, candidate},
                      {.box = options_.box, .peak = options_.peak});
}

}  // namespace esvr::compare
