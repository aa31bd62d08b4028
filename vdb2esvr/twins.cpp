#include "vdb2esvr/twins.h"

#include <algorithm>
#include <utility>

#include "esvr/encode.h"
#include "programs/run_main.h"
#include "vdb2esvr/convert.h"

namespace esvr::vdb2esvr {
namespace {

/// True if the summaries allow that two grids have the same voxels.
bool maybeTwins(const GridSummary& a, const GridSummary& b) {
  return a.activeVoxels == b.activeVoxels && a.activeBox == b.activeBox;
}

bool maybeHasTwin(const std::vector<FittedGrid>& grids, const FittedGrid& grid) {
  return std::count_if(grids.begin(), grids.end(), [&](const auto& other) {
           return maybeTwins(grid.source, other.source);
         }) > 1;
}

/// Reads grids and remembers the keys of those that are the first with their voxels. A key takes 16
/// bytes, so that no volume has to be kept for a comparison.
class TwinSearch {
 public:
  explicit TwinSearch(const Options& options) : options_(options) {}

  void read(std::size_t index, const FittedGrid& fitted) {
    cli::Stopwatch watch;
    VolumeGrid grid = sayingTheWayOut(fitted, [&] { return readSource(options_, fitted); });
    const auto [first, isNew] = firstBy_.emplace(sourceKeyOf(options_, fitted, grid), index);
    if (isNew) return;
    twins_[index] = {first->second, std::move(grid.descriptor), grid.nonFiniteReplaced,
                     grid.inactive, watch.lap()};
  }

  [[nodiscard]] Twins take() { return std::move(twins_); }

 private:
  const Options& options_;
  std::map<SourceKey, std::size_t> firstBy_;
  Twins twins_;
};

}  // namespace

Twins findTwins(const Options& options, const std::vector<FittedGrid>& grids) {
  TwinSearch search(options);
  for (std::size_t g = 0; g < grids.size() && !options.convert.fit.cancel->cancelled(); ++g)
    if (maybeHasTwin(grids, grids[g])) search.read(g, grids[g]);
  return search.take();
}

}  // namespace esvr::vdb2esvr
