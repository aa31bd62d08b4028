#include "field/extreme_ellipsoids.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace esvr {
namespace {

/// The figures of one ellipsoid.
struct Figures {
  double smallest, largest, aspect, intensity, kappa;
};

Figures figuresOf(const Field& field, const Ellipsoids& e, std::size_t i) {
  const auto [low, high] = std::minmax({e.logScale[0][i], e.logScale[1][i], e.logScale[2][i]});
  return {std::exp(double(low)), std::exp(double(high)), std::exp(double(high) - double(low)),
          std::abs(double(e.intensity[i])),
          e.kappa.empty() ? double(field.kernel.kappa) : double(e.kappa[i])};
}

/// Calls visit(figures, chunk, index in the chunk) for every ellipsoid.
template <class Visit>
void forEachFigures(const Field& field, Visit&& visit) {
  for (const Chunk& chunk : field.chunks)
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i)
      visit(figuresOf(field, chunk.ellipsoids, i), chunk, i);
}

/// The place of an ellipsoid, and the figure by which it was chosen.
struct Candidate {
  double figure = 0.0;
  const Chunk* chunk = nullptr;
  std::size_t index = 0;

  void replaceIfBelow(double other, const Chunk& by, std::size_t i) {
    if (chunk == nullptr || other > figure) *this = {other, &by, i};
  }
  [[nodiscard]] Coord center() const {
    const auto along = [&](std::size_t a, std::int32_t origin) {
      const double at = std::round(double(origin) + double(chunk->ellipsoids.center[a][index]));
      return std::int32_t(std::clamp(at, double(Box::kMin), double(Box::kMax)));
    };
    return {along(0, chunk->origin.x), along(1, chunk->origin.y), along(2, chunk->origin.z)};
  }
};

}  // namespace

FieldExtremes extremesOf(const Field& field) {
  FieldExtremes all;
  bool first = true;
  forEachFigures(field, [&](const Figures& f, const Chunk&, std::size_t) {
    const auto lower = [&](double& value, double by) { value = first ? by : std::min(value, by); };
    const auto raise = [&](double& value, double by) { value = first ? by : std::max(value, by); };
    lower(all.smallestScale, f.smallest), raise(all.largestScale, f.largest);
    raise(all.largestAspect, f.aspect);
    lower(all.lowestKappa, f.kappa), raise(all.highestKappa, f.kappa);
    lower(all.smallestIntensity, f.intensity), raise(all.largestIntensity, f.intensity);
    first = false;
  });
  all.largestCondition = all.largestAspect * all.largestAspect;
  return all;
}

std::vector<Coord> centersOfExtremes(const Field& field) {
  Candidate smallest, largest, aspect, intensity;
  forEachFigures(field, [&](const Figures& f, const Chunk& chunk, std::size_t i) {
    smallest.replaceIfBelow(-f.smallest, chunk, i);
    largest.replaceIfBelow(f.largest, chunk, i);
    aspect.replaceIfBelow(f.aspect, chunk, i);
    intensity.replaceIfBelow(f.intensity, chunk, i);
  });
  std::vector<Coord> centers;
  for (const Candidate& c : {smallest, largest, aspect, intensity})
    if (c.chunk != nullptr) centers.push_back(c.center());
  return centers;
}

}  // namespace esvr
