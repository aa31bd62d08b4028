#include "fit/intensity_problem.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "esvr/field.h"

namespace esvr {
namespace {

using Range = tbb::blocked_range<std::size_t>;
constexpr std::size_t kBrickGrain = 4, kEllipsoidGrain = 256;
/// Pairs whose tapes are kept from pass to pass: some 200 MB. More are worked out anew each time.
constexpr std::size_t kMostKept = 400'000;
constexpr double kEnough = 1e-10;  // of the gradient's square, preconditioned

std::vector<Coord> cornersOf(const Field& field, const IntensityTarget& target) {
  std::vector<Coord> corners(target.bricks.begin(), target.bricks.end());
  if (target.restrictToBricks) return corners;
  const auto reached = reachedBricks(field);
  corners.insert(corners.end(), reached.begin(), reached.end());
  for (std::size_t b = 0; b < target.source.brickCount(); ++b)
    corners.push_back(target.source.brickCorner(b));
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return corners;
}

/// Sets the voxels of a mask to 0; most words of it are all ones or none.
void clearVoxels(const BrickMask& mask, float* values) {
  for (const std::uint64_t word : mask.words) {
    if (word == ~std::uint64_t{0}) {
      std::fill_n(values, 64, 0.0f);
    } else {
      for (std::uint64_t left = word; left != 0; left &= left - 1)
        values[std::countr_zero(left)] = 0.0f;
    }
    values += 64;
  }
}

bool contains(const Box& box, Coord corner) {
  return box.contains(corner) &&
         box.contains(corner + Coord{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1});
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

void addScaled(std::vector<double>& a, double scale, const std::vector<double>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += scale * b[i];
}

}  // namespace

IntensityProblem::IntensityProblem(const Field& field, const IntensityTarget& target)
    : source_(target.source),
      stored_(target.stored),
      box_(target.box),
      background_(field.background),
      corners_(cornersOf(field, target)),
      plan_(planEvaluation(field, corners_)),
      projections_(plan_.pairs.pairCount()),
      kept_(corners_.size()),
      brickError_(corners_.size()),
      exact_(corners_.size()) {}

void IntensityProblem::setForms(std::span<const float> intensities) {
  for (std::size_t i = 0; i < intensities.size(); ++i)
    plan_.field.forms[i].intensity = intensities[i];
}

/// The sum of a brick's ellipsoids, and their phi on the tapes.
const std::vector<PairTape>& IntensityProblem::forward(std::size_t brick, PairTapes& scratch,
                                                       float* sum) {
  const BrickKernels& kernels = brickKernels();
  const auto& [gathered, pairs] = plan_;
  const auto begin = pairs.brickBegin[brick], end = pairs.brickBegin[brick + 1];
  std::vector<PairTape>& kept = kept_[brick].tapes;
  if (kept.size() == end - begin) {
    for (auto pair = begin; pair != end; ++pair)
      kernels.addTape(kept[pair - begin], gathered.forms[pairs.ellipsoid[pair]].intensity, sum);
    return kept;
  }
  scratch.reserve(end - begin);
  float* phi = scratch.phi.get();
  for (auto pair = begin; pair != end; ++pair) {
    const auto i = pairs.ellipsoid[pair];
    const Coord local = corners_[brick] - gathered.origin(i);
    const float corner[3] = {float(local.x), float(local.y), float(local.z)};
    PairTape& tape = scratch.tapes[pair - begin];
    tape.phi = phi;
    kernels.forward(gathered.forms[i], corner, gathered.kernel(i), sum, tape);
    phi += tape.floats;
  }
  if (pairs.pairCount() <= kMostKept) kept_[brick] = KeptTapes(scratch.tapes);
  return scratch.tapes;
}

/// Forward over every brick, middle(brick, sum), which makes the sum what is to be projected on
/// the ellipsoids, and backward.
template <class Middle>
void IntensityProblem::pass(std::vector<double>* rPhi, std::vector<double>* phi2,
                            const Middle& middle) {
  const auto& pairs = plan_.pairs;
  tbb::enumerable_thread_specific<PairTapes> scratches;
  tbb::parallel_for(Range(0, corners_.size(), kBrickGrain), [&](const Range& range) {
    PairTapes& scratch = scratches.local();
    for (std::size_t b = range.begin(); b != range.end(); ++b) {
      alignas(64) float sum[kBrickVoxels] = {};
      const std::vector<PairTape>& tapes = forward(b, scratch, sum);
      middle(b, sum);
      if (!rPhi && !phi2) continue;
      const auto begin = pairs.brickBegin[b];
      for (std::size_t k = 0; k < tapes.size(); ++k)
        brickKernels().projectTape(tapes[k], sum, projections_[begin + k]);
    }
  });
  const std::size_t n = plan_.field.forms.size();
  const auto reduce = [&](std::vector<double>* out, float PairProjection::*value) {
    if (!out) return;
    out->assign(n, 0.0);
    tbb::parallel_for(Range(0, n, kEllipsoidGrain), [&](const Range& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i)
        for (auto k = pairs.ellipsoidBegin[i]; k != pairs.ellipsoidBegin[i + 1]; ++k)
          (*out)[i] += double(projections_[pairs.pairOf[k]].*value);
    });
  };
  reduce(rPhi, &PairProjection::rPhi);
  reduce(phi2, &PairProjection::phi2);
}

double IntensityProblem::residualOf(std::size_t brick, float* sum, BrickMask* exact) const {
  const auto at = findBrick(source_, brickOf(corners_[brick] - source_.origin));
  const float* const values = at ? source_.brickValues(*at).data() : nullptr;
  const bool inBox = contains(box_, corners_[brick]);
  double error = 0.0;
  for (int v = 0; v < kBrickVoxels; ++v) {
    const float wanted = values ? values[v] : source_.background;
    const float value = background_ + sum[v];
    const double missed = double(stored_(value)) - double(wanted);
    sum[v] = missed == 0.0 ? 0.0f : value - wanted;
    if (missed == 0.0) {
      if (exact) exact->set(v);
    } else if (inBox || box_.contains(corners_[brick] + voxelLocal(v))) {
      error += missed * missed;
    }
  }
  return error;
}

double IntensityProblem::error(std::span<const float> intensities) {
  setForms(intensities);
  pass(nullptr, nullptr,
       [&](std::size_t b, float* sum) { brickError_[b] = residualOf(b, sum, nullptr); });
  double total = 0.0;
  for (const double e : brickError_) total += e;
  return total;
}

const std::vector<double>& IntensityProblem::curvature() {
  if (curvature_.empty()) pass(nullptr, &curvature_, [](std::size_t, float*) {});
  return curvature_;
}

double IntensityProblem::gradientAt(std::span<const float> intensities,
                                    std::vector<double>& gradient) {
  setForms(intensities);
  pass(&gradient, &curvature_, [&](std::size_t b, float* sum) {
    exact_[b] = {};
    brickError_[b] = residualOf(b, sum, &exact_[b]);
  });
  double total = 0.0;
  for (const double e : brickError_) total += e;
  return total;
}

void IntensityProblem::applyNormal(std::span<const double> direction, std::vector<double>& out) {
  for (std::size_t i = 0; i < direction.size(); ++i)
    plan_.field.forms[i].intensity = float(direction[i]);
  pass(&out, nullptr, [&](std::size_t b, float* sum) { clearVoxels(exact_[b], sum); });
}

/// The step x that lowers |A x + r|^2, from A^T r.
std::vector<double> IntensityProblem::conjugateGradients(std::vector<double> residual,
                                                         int iterations) {
  const std::size_t n = residual.size();
  std::vector<double> x(n), z(n), p(n), q;
  for (double& r : residual) r = -r;
  const auto precondition = [&] {
    for (std::size_t i = 0; i < n; ++i)
      z[i] = curvature_[i] > 0.0 ? residual[i] / curvature_[i] : 0.0;
  };
  precondition();
  p = z;
  double rho = dot(residual, z);
  const double enough = rho * kEnough;
  for (int k = 0; k < iterations && rho > enough; ++k) {
    applyNormal(p, q);
    const double alpha = rho / dot(p, q);
    if (!std::isfinite(alpha)) break;
    addScaled(x, alpha, p);
    addScaled(residual, -alpha, q);
    precondition();
    const double next = dot(residual, z);
    const double beta = next / rho;
    rho = next;
    for (std::size_t i = 0; i < n; ++i) p[i] = z[i] + beta * p[i];
  }
  return x;
}

double IntensityProblem::solve(std::vector<float>& intensities, int iterations) {
  std::vector<double> gradient;
  const double before = gradientAt(intensities, gradient);
  const auto step = conjugateGradients(std::move(gradient), iterations);
  std::vector<float> tried(intensities.size());
  const bool signs = std::any_of(intensities.begin(), intensities.end(),
                                 [](float intensity) { return intensity < 0.0f; });
  const double lowest = signs ? -HUGE_VAL : 0.0;
  for (double share = 1.0; share > 0.1; share *= 0.5) {
    for (std::size_t i = 0; i < tried.size(); ++i)
      tried[i] = float(std::max(lowest, intensities[i] + share * step[i]));
    const double after = error(tried);
    if (!(after < before)) continue;
    intensities = tried;
    return after;
  }
  return before;
}

std::vector<float> intensitiesOf(const Field& field) {
  std::vector<float> all;
  for (const auto& chunk : field.chunks)
    all.insert(all.end(), chunk.ellipsoids.intensity.begin(), chunk.ellipsoids.intensity.end());
  return all;
}

void setIntensities(std::span<const float> intensities, Field& field) {
  for (auto& chunk : field.chunks) {
    auto& own = chunk.ellipsoids.intensity;
    std::copy_n(intensities.begin(), own.size(), own.begin());
    intensities = intensities.subspan(own.size());
  }
}

}  // namespace esvr
