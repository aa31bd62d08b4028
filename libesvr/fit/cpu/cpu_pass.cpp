#include "fit/cpu/cpu_pass.h"

#include <bit>
#include <limits>
#include <utility>

#include "core/parallel.h"
#include "field/evaluate.h"

namespace esvr {
namespace {

template <class Visit>
void visitAll(std::size_t count, std::size_t grain, const Visit& visit) {
  using Indices = tbb::blocked_range<std::size_t>;
  parallelFor(Indices(0, count, grain), [&](const Indices& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) visit(i);
  });
}

template <class Visit>
void visitEllipsoids(std::size_t count, const Visit& visit) {
  visitAll(count, 64, visit);
}

template <class Visit>
void visitBricks(const BrickIndex& index, const Visit& visit) {
  visitAll(index.size(), 4, visit);
}

/// The values of a brick. \param all  those of the target's bricks; the others have zeros
const float* targetBrick(std::span<const float> all, std::size_t brick) {
  alignas(64) static constexpr float kZeros[kBrickVoxels] = {};
  return (brick + 1) * kBrickVoxels <= all.size() ? all.data() + brick * kBrickVoxels : kZeros;
}

}  // namespace

CpuPass::CpuPass(const FitTarget& target, PassKernels kernels)
    : target_(target), kernels_(std::move(kernels)), index_(target.bricks) {}

void CpuPass::rebuild(std::span<const Ellipsoid> ellipsoids, double slack) {
  supports_.resize(ellipsoids.size());
  visitEllipsoids(ellipsoids.size(), [&](std::size_t i) {
    supports_[i] = makeSupport(ellipsoids[i].center, ellipsoids[i].L, kernels_.radius(i), slack);
  });
  listSupports();
}

void CpuPass::rebuild(std::span<const ListedSupport> listed) {
  supports_.resize(listed.size());
  visitEllipsoids(listed.size(), [&](std::size_t i) {
    supports_[i] = makeSupport(listed[i].center, listed[i].L, listed[i].reach, kRoundingSlack);
  });
  listSupports();
}

void CpuPass::listSupports() {
  const auto supportOf = [&](std::size_t i) -> const Support& { return supports_[i]; };
  index_ = BrickIndex(target_.bricks);
  pairs_ = target_.narrowBand ? pairsWithin(index_, supports_.size(), supportOf)
                              : pairsOfAll(index_, supports_.size(), supportOf,
                                           target_.within.value_or(bricksOf(Box::whole())));
  moments_.resize(pairs_.pairCount());
  placeOf_.resize(pairs_.pairCount());
  visitEllipsoids(supports_.size(), [&](std::size_t i) {
    for (auto k = pairs_.ellipsoidBegin[i]; k != pairs_.ellipsoidBegin[i + 1]; ++k)
      placeOf_[pairs_.pairOf[k]] = k;
  });
}

/// Computes the forms of the current ellipsoids.
void CpuPass::prepare(std::span<const Ellipsoid> ellipsoids) {
  forms_.resize(ellipsoids.size());
  frames_.resize(ellipsoids.size());
  visitEllipsoids(ellipsoids.size(), [&](std::size_t i) {
    const Ellipsoid& p = ellipsoids[i];
    frames_[i] = frameOf(p.center);
    const auto center = inFrame(p.center, frames_[i]);
    forms_[i] = makeBrickForm(center, p.L, kernels_.radius(i), p.intensity);
  });
}

/// Starts the sum of a brick: r = constants - target.
void CpuPass::start(std::size_t brick, float* r) const {
  brickKernels().start(targetBrick(target_.values, brick), r);
  if (target_.constants.empty()) return;
  const float* const constants = targetBrick(target_.constants, brick);
  for (int v = 0; v < kBrickVoxels; ++v) r[v] += constants[v];
}

/// Clamps the sum of a brick if the target saturates. \return sum of r^2
double CpuPass::finish(std::size_t brick, float* r) const {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const bool clamps = target_.saturates;
  return brickKernels().finish(targetBrick(target_.values, brick),
                               clamps ? float(target_.lowest) : -kInfinity,
                               clamps ? float(target_.highest) : kInfinity, r);
}

/// Adds the ellipsoids of a brick to the sum and records phi on the tapes.
void CpuPass::forward(std::size_t brick, PairTapes& scratch, float* sum) const {
  const auto begin = pairs_.brickBegin[brick], end = pairs_.brickBegin[brick + 1];
  const Coord corner = index_.bricks()[brick] * kBrickSide;
  const BrickKernels& kernels = brickKernels();
  scratch.reserve(end - begin);
  float* phi = scratch.phi.get();
  for (auto pair = begin; pair != end; ++pair) {
    const auto i = pairs_.ellipsoid[pair];
    const auto at = cornerIn(frames_[i], corner);
    PairTape& tape = scratch.tapes[pair - begin];
    tape.phi = phi;
    kernels.forward(forms_[i], at.data(), kernels_.constants(i), sum, tape);
    phi += tape.floats;
  }
}

/// Computes the moments of the brick's pairs. \param byValue  derivative of the loss by V
void CpuPass::backward(std::size_t brick, const PairTapes& scratch, const float* byValue) {
  const auto begin = pairs_.brickBegin[brick], end = pairs_.brickBegin[brick + 1];
  const Coord corner = index_.bricks()[brick] * kBrickSide;
  const BrickKernels& kernels = brickKernels();
  for (auto pair = begin; pair != end; ++pair) {
    const PairTape& tape = scratch.tapes[pair - begin];
    PairMoments& moments = moments_[placeOf_[pair]];
    if (tape.rows == 0) {  // a third of the pairs, because lists have a slack
      moments = {};
      continue;
    }
    const auto i = pairs_.ellipsoid[pair];
    const auto at = cornerIn(frames_[i], corner);
    kernels.backward(forms_[i], at.data(), kernels_.constants(i), byValue, tape, moments);
  }
}

/// Computes the gradients from the moments of all pairs.
void CpuPass::reduce(std::span<EllipsoidGradient> out) const {
  visitEllipsoids(forms_.size(), [&](std::size_t i) {
    const auto begin = pairs_.ellipsoidBegin[i], end = pairs_.ellipsoidBegin[i + 1];
    MomentTotals sums;
    brickKernels().sumMoments(moments_.data() + begin, end - begin, sums);
    out[i] = ellipsoidGradient(forms_[i], std::bit_cast<PairSums>(sums),
                               double(kernels_.constants(i).slope));
  });
}

void CpuPass::residuals(std::span<const Ellipsoid> ellipsoids, std::vector<float>& out) {
  prepare(ellipsoids);
  out.resize(index_.size() * kBrickVoxels);
  visitBricks(index_, [&](std::size_t b) {
    alignas(64) float r[kBrickVoxels];
    start(b, r);
    const Coord corner = index_.bricks()[b] * kBrickSide;
    for (auto pair = pairs_.brickBegin[b]; pair != pairs_.brickBegin[b + 1]; ++pair) {
      const auto i = pairs_.ellipsoid[pair];
      brickKernels().add(forms_[i], cornerIn(frames_[i], corner).data(), kernels_.constants(i), r);
    }
    finish(b, r);
    std::copy_n(r, kBrickVoxels, out.data() + b * kBrickVoxels);
  });
}

double CpuPass::gradients(std::span<const Ellipsoid> ellipsoids, std::span<EllipsoidGradient> out,
                          std::vector<float>* residuals) {
  prepare(ellipsoids);
  brickLoss_.resize(index_.size());
  if (residuals) residuals->resize(index_.size() * kBrickVoxels);
  visitBricks(index_, [&](std::size_t b) {
    PairTapes& scratch = tapes_.local();
    alignas(64) float r[kBrickVoxels];
    start(b, r);
    forward(b, scratch, r);
    brickLoss_[b] = finish(b, r);
    if (residuals) std::copy_n(r, kBrickVoxels, residuals->data() + b * kBrickVoxels);
    backward(b, scratch, r);
  });
  reduce(out);
  double loss = 0.0;
  for (const double l : brickLoss_) loss += l;
  return loss;
}

void CpuPass::gradients(std::span<const Ellipsoid> ellipsoids, std::span<const float> lossByValue,
                        std::span<EllipsoidGradient> out) {
  prepare(ellipsoids);
  visitBricks(index_, [&](std::size_t b) {
    PairTapes& scratch = tapes_.local();
    alignas(64) float sum[kBrickVoxels] = {};
    forward(b, scratch, sum);
    backward(b, scratch, lossByValue.data() + b * kBrickVoxels);
  });
  reduce(out);
}

}  // namespace esvr
