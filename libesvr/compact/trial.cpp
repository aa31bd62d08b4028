#include "compact/trial.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "esvr/metrics.h"
#include "format/grid_rule.h"
#include "format/layered_section.h"

namespace esvr {
namespace {

constexpr double kInvisiblePsnr = 110.0;

/// Of the solver. Rounded shapes begin with the intensities of the float32 ones: what three
/// iterations leave is a thousandth of the error.
constexpr int kFirstIterations = 8, kIterations = 3;

/// One of so many cubes of bricks is a sample, where there are bricks enough to tell.
constexpr std::int32_t kSampled = 4;
constexpr int kCubeLog2 = 2;  // of its side, in bricks
constexpr std::size_t kMinSampled = 1024;

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

/// Fits the intensities to the shapes of the trial's field, and rounds them.
void solveIntensities(IntensityProblem& problem, Trial& trial) {
  problem.setShapes(trial.field);
  const auto before = intensitiesOf(trial.field);
  auto intensities = before;
  const double least = problem.step(intensities, kIterations);
  storeIntensities(intensities, trial);
  trial.error = problem.error(intensitiesOf(trial.field)).squares;
  if (trial.error <= least) return;
  intensities = before;  // a shorter step, if there is one that serves
  (void)problem.solve(intensities, kIterations);
  storeIntensities(intensities, trial);
  trial.error = problem.error(intensitiesOf(trial.field)).squares;
}

/// Empty where there are too few.
std::vector<Coord> sampleOf(std::vector<Coord> corners) {
  if (corners.size() < kMinSampled) return {};
  std::erase_if(corners, [](Coord corner) {
    const Coord brick = brickOf(corner);
    const std::int32_t cube =
        (brick.x >> kCubeLog2) + (brick.y >> kCubeLog2) + (brick.z >> kCubeLog2);
    return (cube & (kSampled - 1)) != 0;
  });
  return corners;
}

void countBytes(Trial& trial) {
  for (const auto& chunk : trial.quantised) trial.bytes += format::storedBytes(chunk);
}

std::size_t layersOf(const Trial& trial) {
  std::size_t layers = 1;
  for (const auto& chunk : trial.quantised) layers = std::max(layers, chunk.layerEnds.size());
  return layers;
}

/// A trial's intensities, zero beyond the first layers.
std::vector<float> ofFirstLayers(const Trial& trial, std::size_t layers) {
  std::vector<float> all = intensitiesOf(trial.field);
  auto chunk = all.begin();
  for (const auto& q : trial.quantised) {
    const auto end = chunk + std::ptrdiff_t(q.size());
    if (q.layerEnds.size() > layers)
      std::fill(chunk + std::ptrdiff_t(q.layerEnds[layers - 1]), end, 0.0f);
    chunk = end;
  }
  return all;
}

}  // namespace

TrialMaker::TrialMaker(const StoredGrid& grid, const TrialTarget& target)
    : target_{target.source, format::ruleOf(grid), target.box, grid.leaves,
              grid.topology != TopologyKind::kThreshold},
      sampleBricks_(sampleOf(knownCorners(target_))),
      sampleTarget_{target.source, target_.rule, target.box, sampleBricks_, true},
      problem_(target_, target.device),
      sampleProblem_(sampleTarget_, target.device),
      field_(grid.field),
      peak_(peakOf(target.source)) {
  problem_.setShapes(field_);
  auto intensities = intensitiesOf(field_);
  error_ = problem_.error(intensities).squares;
  leastError_ = problem_.solve(intensities, kFirstIterations);
  setIntensities(intensities, field_);
  curvature_ = byChunk(field_, problem_.curvature());
}

double TrialMaker::squaresOf(double psnr) const {
  return peak_ * peak_ * target_.box.volume() * std::pow(10.0, -psnr / 10.0);
}

double TrialMaker::invisibleError() const { return squaresOf(kInvisiblePsnr); }

/// The field then has rounded shapes and its old intensities, in the file's order.
void TrialMaker::quantiseChunks(Trial& trial) const {
  trial.quantised.resize(field_.chunks.size());
  tbb::parallel_for(std::size_t{0}, field_.chunks.size(), [&](std::size_t c) {
    const Ellipsoids& e = field_.chunks[c].ellipsoids;
    std::vector<std::size_t> order;
    trial.quantised[c] = quantise(e, chooseLattice(e, curvature_[c], trial.steps), order);
    Ellipsoids& rounded = trial.field.chunks[c].ellipsoids;
    rounded = dequantise(trial.quantised[c]);
    for (std::size_t i = 0; i < order.size(); ++i) rounded.intensity[i] = e.intensity[order[i]];
  });
}

Trial TrialMaker::make(const QuantiserSteps& steps) {
  return std::move(make(std::span(&steps, 1)).front());
}

std::vector<Trial> TrialMaker::make(std::span<const QuantiserSteps> steps) {
  return make(steps, problem_);
}

std::vector<Trial> TrialMaker::sample(std::span<const QuantiserSteps> steps) {
  return make(steps, sampleBricks_.empty() ? problem_ : sampleProblem_);
}

std::vector<Trial> TrialMaker::make(std::span<const QuantiserSteps> steps,
                                    IntensityProblem& problem) const {
  std::vector<Trial> trials(steps.size());
  tbb::parallel_for(std::size_t{0}, trials.size(), [&](std::size_t k) {
    trials[k] = {steps[k], field_, {}, 0.0, 0};
    quantiseChunks(trials[k]);
  });
  for (Trial& trial : trials) solveIntensities(problem, trial);  // with all threads, or the GPU
  tbb::parallel_for(std::size_t{0}, trials.size(), [&](std::size_t k) { countBytes(trials[k]); });
  return trials;
}

std::vector<LayerError> TrialMaker::layerErrors(const Trial& trial) {
  std::vector<LayerError> errors;
  const std::size_t layers = layersOf(trial);
  if (layers < 2) return errors;
  problem_.setShapes(trial.field);
  for (std::size_t k = 1; k <= layers; ++k) {
    const StoredError error = problem_.error(ofFirstLayers(trial, k));
    errors.push_back(
        {float(psnr(error.squares / target_.box.volume(), peak_)), float(error.largest)});
  }
  return errors;
}

}  // namespace esvr
