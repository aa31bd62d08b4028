#include <algorithm>
#include <utility>

#include "compact/measure_layers.h"
#include "esvr/error.h"
#include "esvr/residual.h"

namespace esvr {
namespace {

constexpr std::uint64_t kEllipsoidShare = 4;  // of the voxels' bytes, one part
constexpr double kHopeful = 1.15;             // of them: what a short fit may take for a full one
constexpr std::uint32_t kShortShare = 4;      // of the iterations

std::uint64_t bytesOf(const StoredGrid& grid) {
  return encodeEsvr({{}, {grid}}).size() - encodeEsvr({}).size();
}

RateInput shortened(RateInput input) {
  if (input.options.iterations)
    input.options.iterations = std::max(*input.options.iterations / kShortShare, 1u);
  input.options.preset = Preset::kDraft;
  return input;
}

/// Nothing where there is no grid of so few bytes or no residual to it.
std::optional<RatedGrid> attempt(const RateInput& input, double bound, std::uint64_t bytes) try {
  RatedGrid rated = fitToSize(input, bytes);
  auto grid = withResidual(std::move(rated.grid), input.source, bound);
  if (!grid) return std::nullopt;
  rated.grid = std::move(*grid);
  rated.grid.layerErrors =
      measureLayers(rated.grid, input.source, input.options.box.value_or(activeBox(input.source)));
  return rated;
} catch (const UsageError&) {  // too few bytes for the grid
  return std::nullopt;
}

}  // namespace

BoundedFit fitWithin(const RateInput& input, double bound, std::uint64_t voxelBytes) {
  BoundedFit best;
  for (const RateInput& now : {shortened(input), input}) {
    auto rated = attempt(now, bound, voxelBytes / kEllipsoidShare);
    if (!rated) return best;
    const std::uint64_t bytes = bytesOf(rated->grid);
    if (best.bytes == 0 || bytes < best.bytes) best.bytes = bytes;
    if (bytes < voxelBytes && bytes == best.bytes) best.rated = std::move(rated);
    if (double(bytes) > kHopeful * double(voxelBytes)) return best;
  }
  return best;
}

}  // namespace esvr
