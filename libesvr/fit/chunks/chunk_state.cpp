#include "fit/chunks/chunk_state.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "fit/ellipsoid_math.h"

namespace esvr {
namespace {

double energyOf(const ChunkScene& scene, std::uint32_t brick) {
  const SparseVolume& volume = scene.volume;
  const auto values = volume.brickValues(brick);
  double energy = 0.0;
  for (int v = 0; v < kBrickVoxels; ++v) {
    const double value = (double(values[v]) - volume.background) * scene.scale.scale;
    if (volume.active[brick].test(v)) energy += value * value;
  }
  return energy;
}

/// A number to which the integral of an ellipsoid's square is proportional.
double energyOf(const Ellipsoid& p) {
  return p.intensity * p.intensity / std::abs(ellipsoid_math::asEigen(p.L).determinant());
}

FitState without(const FitState& fit, const std::vector<bool>& dropped) {
  FitState kept;
  for (std::size_t i = 0; i < fit.ellipsoids.size(); ++i) {
    if (dropped[i]) continue;
    kept.ellipsoids.push_back(fit.ellipsoids[i]);
    kept.adam.push_back(fit.adam[i]);
  }
  return kept;
}

}  // namespace

double energyOf(const ChunkScene& scene, const BrickChunk& chunk) {
  std::vector<double> energy(chunk.bricks.size());
  parallelFor(std::size_t{0}, energy.size(),
              [&](std::size_t n) { energy[n] = energyOf(scene, chunk.bricks[n]); });
  return std::accumulate(energy.begin(), energy.end(), 0.0);
}

void dropSurplus(std::size_t most, std::vector<ChunkState>& states) {
  struct Item {
    double energy;
    std::size_t chunk, index;
    auto operator<=>(const Item&) const = default;
  };
  std::vector<Item> items;
  for (std::size_t c = 0; c < states.size(); ++c)
    for (std::size_t i = 0; i < states[c].count(); ++i)
      items.push_back({energyOf(states[c].fit.ellipsoids[i]), c, i});
  if (items.size() <= most) return;
  const auto end = items.end() - std::ptrdiff_t(most);
  std::nth_element(items.begin(), end, items.end());
  std::vector<std::vector<bool>> dropped;
  for (const ChunkState& state : states) dropped.emplace_back(state.count());
  for (auto item = items.begin(); item != end; ++item) dropped[item->chunk][item->index] = true;
  for (std::size_t c = 0; c < states.size(); ++c)
    states[c].fit = without(states[c].fit, dropped[c]);
}

}  // namespace esvr
