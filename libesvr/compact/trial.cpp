#include "compact/trial.h"

#include <cmath>
#include <utility>

#include "esvr/metrics.h"
#include "format/grid_rule.h"
#include "format/layered_section.h"

namespace esvr {
namespace {

constexpr double kInvisiblePsnr = 110.0;

std::vector<std::vector<double>> byChunk(const Field& field, const std::vector<double>& all) {
  std::vector<std::vector<double>> result;
  auto at = all.begin();
  for (const auto& chunk : field.chunks) {
    const auto end = at + std::ptrdiff_t(chunk.ellipsoids.size());
    result.emplace_back(at, end);
    at = end;
  }
  return result;
}

/// Intensities become what is stored of them. \param intensities  of all chunks
void storeIntensities(std::span<const float> intensities, Trial& trial) {
  for (std::size_t c = 0; c < trial.quantised.size(); ++c) {
    QuantisedEllipsoids& q = trial.quantised[c];
    quantiseIntensities(intensities.first(q.size()), q);
    intensities = intensities.subspan(q.size());
    trial.field.chunks[c].ellipsoids = dequantise(q);
  }
}

}  // namespace

double squaresOf(double psnr, const SparseVolume& source, const Box& box) {
  const double peak = peakOf(source);
  return peak * peak * box.volume() * std::pow(10.0, -psnr / 10.0);
}

TrialMaker::TrialMaker(const EncodedGrid& grid, const SparseVolume& source, const Box& box)
    : field_(grid.field),
      target_{source,
              {format::ruleOf(grid), grid.activeThreshold},
              box,
              grid.leaves,
              grid.topology != TopologyKind::kThreshold} {
  IntensityProblem problem(field_, target_);
  error_ = problem.error(intensitiesOf(field_));
  curvature_ = byChunk(field_, problem.curvature());
  invisible_ = squaresOf(kInvisiblePsnr, source, box);
}

/// The field then has rounded shapes and its old intensities, in the file's order.
void TrialMaker::quantiseChunks(Trial& trial) const {
  for (std::size_t c = 0; c < field_.chunks.size(); ++c) {
    const Ellipsoids& e = field_.chunks[c].ellipsoids;
    std::vector<std::size_t> order;
    trial.quantised.push_back(quantise(e, chooseLattice(e, curvature_[c], trial.steps), order));
    Ellipsoids& rounded = trial.field.chunks[c].ellipsoids;
    rounded = dequantise(trial.quantised.back());
    for (std::size_t i = 0; i < order.size(); ++i) rounded.intensity[i] = e.intensity[order[i]];
  }
}

void TrialMaker::solveIntensities(Trial& trial, int iterations) const {
  IntensityProblem problem(trial.field, target_);
  auto intensities = intensitiesOf(trial.field);
  if (iterations > 0) problem.solve(intensities, iterations);
  storeIntensities(intensities, trial);
  trial.error = problem.error(intensitiesOf(trial.field));
}

Trial TrialMaker::make(const QuantiserSteps& steps, int iterations) const {
  Trial trial{steps, field_, {}, 0.0, 0};
  quantiseChunks(trial);
  solveIntensities(trial, iterations);
  for (const auto& chunk : trial.quantised) trial.bytes += format::storedBytes(chunk);
  return trial;
}

}  // namespace esvr
