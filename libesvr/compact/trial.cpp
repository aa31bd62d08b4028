#include "compact/trial.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "esvr/metrics.h"
#include "format/ellipsoid_sections.h"
#include "format/grid_rule.h"

namespace esvr {
namespace {

/// PSNR, dB, above which a loss by quantising does not matter.
constexpr double kNegligiblePsnr = 110.0;

/// Iterations of the solver: for the float32 shapes, and for rounded shapes, which start from the
/// intensities of the float32 ones. Further iterations would change the error of a trial by a
/// thousandth (docs/lab-notes.md, "Number of trials").
constexpr int kFirstIterations = 8, kIterations = 3;

/// A sample takes one of kCubesPerSample cubes of 4^3 bricks. Smaller volumes are not sampled.
constexpr std::int32_t kCubesPerSample = 4;
constexpr int kCubeSideLog2 = 2;  // in bricks
constexpr std::size_t kMinBricksToSample = 1024;

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

/// Quantises new intensities of a trial and dequantises its field.
/// \param intensities  intensities of all chunks, in the file's order
void storeIntensities(std::span<const float> intensities, Trial& trial) {
  for (std::size_t c = 0; c < trial.quantised.size(); ++c) {
    QuantisedEllipsoids& q = trial.quantised[c];
    quantiseIntensities(intensities.first(q.size()), q);
    intensities = intensities.subspan(q.size());
    trial.field.chunks[c].ellipsoids = dequantise(q);
  }
}

/// Solves for the intensities with the shapes of the trial's field, and rounds them.
void solveIntensities(IntensityProblem& problem, Trial& trial) {
  problem.setShapes(trial.field);
  const auto before = intensitiesOf(trial.field);
  auto intensities = before;
  const double least = problem.step(intensities, kIterations);
  storeIntensities(intensities, trial);
  trial.error = problem.error(intensitiesOf(trial.field)).squares;
  if (trial.error <= least) return;
  intensities = before;  // the solver may find a shorter step that reduces the error
  (void)problem.solve(intensities, kIterations);
  storeIntensities(intensities, trial);
  trial.error = problem.error(intensitiesOf(trial.field)).squares;
}

/// A sample of the bricks; empty if there are too few bricks.
std::vector<Coord> sampleOf(std::vector<Coord> corners) {
  if (corners.size() < kMinBricksToSample) return {};
  std::erase_if(corners, [](Coord corner) {
    const Coord brick = brickOf(corner);
    const std::int32_t cube =
        (brick.x >> kCubeSideLog2) + (brick.y >> kCubeSideLog2) + (brick.z >> kCubeSideLog2);
    return (cube & (kCubesPerSample - 1)) != 0;
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

/// The intensities of a trial's first layers; those of the other layers are zero.
std::vector<float> intensitiesOfFirstLayers(const Trial& trial, std::size_t layers) {
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
    : bricks_(grid.bricks),
      target_{target.source, format::ruleOf(grid), target.box, bricks_,
              grid.topology != TopologyKind::kThreshold},
      sampleBricks_(sampleOf(knownCorners(target_))),
      sampleTarget_{target_.source, target_.rule, target.box, sampleBricks_, true},
      problem_(target_, target.device),
      sampleProblem_(sampleTarget_, target.device),
      field_(grid.field),
      quick_(target.quick),
      peak_(target.peak ? *target.peak : peakOf(target.source)) {
  if (quick_) {
    auto intensities = intensitiesOf(field_);
    problem_.setShapes(field_);
    error_ = leastError_ = problem_.step(intensities, 0);
  } else {
    solveField();
  }
  curvature_ = byChunk(field_, problem_.curvature());
}

/// Gives the field the best intensities, and measures its error before and after.
void TrialMaker::solveField() {
  auto intensities = intensitiesOf(field_);
  error_ = errorOf(field_, intensities).squares;
  problem_.setShapes(field_);
  (void)problem_.solve(intensities, kFirstIterations);
  leastError_ = errorOf(field_, intensities).squares;
  setIntensities(intensities, field_);
}

double TrialMaker::measure(const Trial& trial) {
  return errorOf(trial.field, intensitiesOf(trial.field)).squares;
}

/// The error of a field against the source.
StoredError TrialMaker::errorOf(const Field& field, std::span<const float> intensities) {
  problem_.setShapes(field);
  return problem_.error(intensities);
}

double TrialMaker::squaresOf(double psnr) const {
  return peak_ * peak_ * target_.box.volume() * std::pow(10.0, -psnr / 10.0);
}

double TrialMaker::negligibleError() const { return squaresOf(kNegligiblePsnr); }

/// Quantises each chunk. The trial's field then has rounded shapes and its old intensities, in the
/// file's order.
void TrialMaker::quantiseChunks(Trial& trial) const {
  trial.quantised.resize(field_.chunks.size());
  parallelFor(std::size_t{0}, field_.chunks.size(), [&](std::size_t c) {
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

std::vector<Trial> TrialMaker::sample(std::span<const QuantiserSteps> steps) {
  return make(steps, sampleBricks_.empty() ? problem_ : sampleProblem_);
}

std::vector<Trial> TrialMaker::make(std::span<const QuantiserSteps> steps,
                                    IntensityProblem& problem) const {
  std::vector<Trial> trials(steps.size());
  parallelFor(std::size_t{0}, trials.size(), [&](std::size_t k) {
    trials[k] = {steps[k], field_, {}, 0.0, 0};
    quantiseChunks(trials[k]);
  });
  // one after the other, since each solution takes all threads or the GPU
  for (Trial& trial : trials) {
    CancelScope::check();
    if (!quick_) {
      solveIntensities(problem, trial);
      continue;
    }
    storeIntensities(intensitiesOf(trial.field), trial);
    trial.error = error_;
  }
  parallelFor(std::size_t{0}, trials.size(), [&](std::size_t k) { countBytes(trials[k]); });
  return trials;
}

std::vector<LayerError> TrialMaker::layerErrors(const Trial& trial) {
  std::vector<LayerError> errors;
  const std::size_t layers = layersOf(trial);
  if (layers < 2) return errors;
  for (std::size_t k = 1; k <= layers; ++k) {
    const StoredError error = errorOf(trial.field, intensitiesOfFirstLayers(trial, k));
    errors.push_back(
        {float(psnr(error.squares / target_.box.volume(), peak_)), float(error.largest)});
  }
  return errors;
}

}  // namespace esvr
