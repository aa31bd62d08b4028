#include "compact/continued_maker.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "codec/continued_coder.h"
#include "esvr/fit.h"
#include "format/continued_section.h"
#include "format/grid_rule.h"

namespace esvr {
namespace {

/// Iterations of the solver before shapes are rounded, and after.
constexpr int kSolverStart = 8, kSolverIterations = 3;

void appendEllipsoid(const Ellipsoids& from, std::size_t i, Coord shift, Ellipsoids& to) {
  const float shifts[] = {float(shift.x), float(shift.y), float(shift.z)};
  for (std::size_t a = 0; a < 3; ++a) {
    to.center[a].push_back(from.center[a][i] + shifts[a]);
    to.logScale[a].push_back(from.logScale[a][i]);
  }
  for (std::size_t a = 0; a < 4; ++a) to.rotation[a].push_back(from.rotation[a][i]);
  to.intensity.push_back(from.intensity[i]);
}

/// The field with the ellipsoids that continue others first, relative to an origin.
Field continuedFirst(const ContinuedFit& fit, std::vector<std::uint32_t>& continues) {
  Field field = fit.grid.field;
  const Chunk own = std::move(field.chunks[0]);
  Chunk& chunk = field.chunks[0];
  chunk.origin = fit.previous.field.chunks[0].origin;
  chunk.ellipsoids = {};
  const Coord shift = own.origin - chunk.origin;
  for (std::size_t i = 0; i < own.ellipsoids.size(); ++i) {
    if (fit.from[i] == kNoStart) continue;
    continues.push_back(fit.from[i]);
    appendEllipsoid(own.ellipsoids, i, shift, chunk.ellipsoids);
  }
  for (std::size_t i = 0; i < own.ellipsoids.size(); ++i)
    if (fit.from[i] == kNoStart) appendEllipsoid(own.ellipsoids, i, shift, chunk.ellipsoids);
  return field;
}

Ellipsoids ellipsoidsFrom(const Ellipsoids& all, std::size_t first) {
  Ellipsoids some;
  for (std::size_t i = first; i < all.size(); ++i) appendEllipsoid(all, i, {}, some);
  return some;
}

void truncate(std::size_t count, Ellipsoids& e) {
  for (auto& plane : e.center) plane.resize(count);
  for (auto& plane : e.logScale) plane.resize(count);
  for (auto& plane : e.rotation) plane.resize(count);
  e.intensity.resize(count);
}

/// The lattice of the previous frame, with cells for all centers.
Lattice withCellsFor(const Ellipsoids& e, Lattice lattice) {
  std::int64_t low[3], high[3];
  const std::int64_t lowest[] = {lattice.lowestCell.x, lattice.lowestCell.y, lattice.lowestCell.z};
  const std::int64_t cells = std::int64_t{1} << lattice.cellBits;
  bool fits = true;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto [min, max] = std::minmax_element(e.center[a].begin(), e.center[a].end());
    low[a] = std::int64_t(std::floor(*min / lattice.cell));
    high[a] = std::int64_t(std::floor(*max / lattice.cell));
    fits = fits && low[a] >= lowest[a] && high[a] < lowest[a] + cells;
  }
  if (fits) return lattice;
  std::int64_t span = 0;
  for (std::size_t a = 0; a < 3; ++a) span = std::max(span, high[a] - low[a]);
  lattice.lowestCell = {std::int32_t(low[0]), std::int32_t(low[1]), std::int32_t(low[2])};
  lattice.cellBits = 0;
  while (span >> lattice.cellBits) ++lattice.cellBits;
  return lattice;
}

/// The precision of an ellipsoid's octave of weight, relative to those of the ellipsoids before.
std::vector<std::uint8_t> newPrecisions(const Ellipsoids& all, std::span<const double> phi2,
                                        std::span<const std::uint32_t> continues,
                                        const QuantisedEllipsoids& before) {
  const auto octave = [&](std::size_t i) {
    return std::log2(std::max(std::abs(double(all.intensity[i])) * std::sqrt(phi2[i]), 1e-300));
  };
  std::vector<double> offsets;
  for (std::size_t i = 0; i < continues.size(); ++i)
    offsets.push_back(double(before.precision[continues[i]]) - octave(i));
  const auto middle = offsets.begin() + std::ptrdiff_t(offsets.size() / 2);
  std::nth_element(offsets.begin(), middle, offsets.end());
  std::vector<std::uint8_t> precisions;
  for (std::size_t i = continues.size(); i < all.size(); ++i)
    precisions.push_back(std::uint8_t(
        std::clamp(std::round(octave(i) + *middle), 0.0, double(Lattice::kMaxPrecision))));
  return precisions;
}

void appendCodes(const QuantisedEllipsoids& from, QuantisedEllipsoids& to) {
  const auto add = [](const auto& source, auto& target) {
    target.insert(target.end(), source.begin(), source.end());
  };
  for (std::size_t a = 0; a < 3; ++a) {
    add(from.position[a], to.position[a]);
    add(from.scale[a], to.scale[a]);
    add(from.rotation[a], to.rotation[a]);
  }
  add(from.precision, to.precision);
  add(from.intensity, to.intensity);
}

}  // namespace

ContinuedMaker::ContinuedMaker(const ContinuedFit& fit, const TrialTarget& target)
    : bricks_(fit.grid.bricks),
      target_{target.source, format::ruleOf(fit.grid), target.box, bricks_,
              fit.grid.topology != TopologyKind::kThreshold},
      problem_(target_, target.device),
      before_(fit.previous.quantised[0]),
      field_(continuedFirst(fit, continues_)) {
  if (!anyContinues()) return;
  auto intensities = intensitiesOf(field_);
  problem_.setShapes(field_);
  (void)problem_.solve(intensities, kSolverStart);
  setIntensities(intensities, field_);
  const Ellipsoids& e = field_.chunks[0].ellipsoids;
  precisions_ = newPrecisions(e, problem_.curvature(), continues_, before_);
  added_ = ellipsoidsFrom(e, continues_.size());
  refine(0);
}

void ContinuedMaker::refine(int octaves) {
  Ellipsoids& e = field_.chunks[0].ellipsoids;
  const Lattice lattice = codec::refined(withCellsFor(e, before_.lattice), octaves);
  std::vector<std::size_t> order;
  fresh_ = quantise(added_, {lattice, precisions_}, order);
  fresh_.lattice = lattice;
  truncate(continues_.size(), e);
  for (const std::size_t i : order) appendEllipsoid(added_, i, {}, e);
}

Trial ContinuedMaker::make(double bitPrice) {
  const Ellipsoids& exact = field_.chunks[0].ellipsoids;
  QuantisedEllipsoids q;
  q.lattice = fresh_.lattice;
  q.continues = continues_;
  q.resize(continues_.size());
  codec::chooseContinued(before_, {&exact, exact.intensity, bitPrice}, q);
  appendCodes(fresh_, q);
  Trial trial{{}, field_, {}, 0.0, 0};
  Ellipsoids& e = trial.field.chunks[0].ellipsoids;
  e = dequantise(q);
  e.intensity = exact.intensity;
  problem_.setShapes(trial.field);
  auto intensities = intensitiesOf(trial.field);
  (void)problem_.solve(intensities, kSolverIterations);
  quantiseIntensities(intensities, q);
  codec::chooseContinued(before_, {nullptr, intensities, bitPrice}, q);
  e = dequantise(q);
  trial.error = problem_.error(intensitiesOf(trial.field)).squares;
  trial.bytes = format::putContinued(q, before_).size();
  trial.quantised.push_back(std::move(q));
  return trial;
}

}  // namespace esvr
