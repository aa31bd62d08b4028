#include "compare/temporal.h"

#include <algorithm>
#include <utility>

#include "esvr/temporal_metrics.h"

namespace esvr::compare {

void TemporalComparison::beginFrame() { before_ = std::exchange(current_, {}); }

std::optional<double> TemporalComparison::compare(const std::string& grid,
                                                  const ComparedVolumes& now) {
  current_[grid] = {now.reference, now.candidate, now.peak};
  const auto found = before_.find(grid);
  if (found == before_.end()) return std::nullopt;
  const Volumes& before = found->second;
  return temporalPsnr({before.reference, now.reference}, {before.candidate, now.candidate},
                      {.box = options_.box, .peak = std::max(before.peak, now.peak)});
}

}  // namespace esvr::compare
