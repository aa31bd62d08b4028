// Coarser levels of detail of a grid: its first layers, or its heaviest ellipsoids.

#include "esvr/encode.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace esvr {
namespace {

void keepLayers(std::size_t layers, QuantisedEllipsoids& q) {
  if (q.layerEnds.size() <= layers) return;
  q.resize(layers == 0 ? 0 : q.layerEnds[layers - 1]);
  q.layerEnds.resize(layers);
  if (layers < 2) q.layerEnds.clear();
}

struct Weighed {
  double weight = 0.0;
  std::size_t chunk = 0, place = 0;
};

double weightOf(const Ellipsoids& e, std::size_t i) {
  const double volume = double(e.logScale[0][i]) + e.logScale[1][i] + e.logScale[2][i];
  return std::abs(double(e.intensity[i])) * std::exp(0.5 * volume);
}

/// All ellipsoids, the heaviest first; ellipsoids of equal weight keep their order.
std::vector<Weighed> weigh(const Field& field) {
  std::vector<Weighed> all;
  for (std::size_t c = 0; c < field.chunks.size(); ++c)
    for (std::size_t i = 0; i < field.chunks[c].ellipsoids.size(); ++i)
      all.push_back({weightOf(field.chunks[c].ellipsoids, i), c, i});
  std::stable_sort(all.begin(), all.end(),
                   [](const Weighed& a, const Weighed& b) { return a.weight > b.weight; });
  return all;
}

void keep(const std::vector<std::size_t>& places, std::vector<float>& values) {
  if (values.empty()) return;
  for (std::size_t k = 0; k < places.size(); ++k) values[k] = values[places[k]];
  values.resize(places.size());
}

/// \param places  increasing indices
void keep(const std::vector<std::size_t>& places, Ellipsoids& e) {
  for (auto& plane : e.center) keep(places, plane);
  for (auto& plane : e.logScale) keep(places, plane);
  for (auto& plane : e.rotation) keep(places, plane);
  keep(places, e.intensity);
  keep(places, e.kappa);
}

}  // namespace

StoredGrid firstLayers(StoredGrid grid, std::size_t layers) {
  const std::size_t all = layerCount(grid);
  for (std::size_t c = 0; c < grid.quantised.size(); ++c) {
    QuantisedEllipsoids& q = grid.quantised[c];
    if (q.layerEnds.size() <= layers) continue;
    keepLayers(layers, q);
    grid.field.chunks[c].ellipsoids = dequantise(q);
  }
  if (layerCount(grid) < all) grid.residual.reset();
  if (grid.layerErrors.size() > layers) grid.layerErrors.resize(layers);
  return grid;
}

StoredGrid heaviest(StoredGrid grid, std::size_t count) {
  if (grid.field.ellipsoidCount() <= count) return grid;
  auto kept = weigh(grid.field);
  kept.resize(count);
  std::vector<std::vector<std::size_t>> places(grid.field.chunks.size());
  for (const Weighed& one : kept) places[one.chunk].push_back(one.place);
  for (std::size_t c = 0; c < places.size(); ++c) {
    std::sort(places[c].begin(), places[c].end());
    keep(places[c], grid.field.chunks[c].ellipsoids);
  }
  grid.quantised.clear();
  grid.layerErrors.clear();
  grid.residual.reset();
  return grid;
}

}  // namespace esvr
