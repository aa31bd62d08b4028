#include "fit/cpu/cpu_pass.h"

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

double sumOfSquares(const float* r) {
  // Eight partial float32 sums of 64 terms each are precise enough and allow SIMD.
  float part[8] = {};
  for (int v = 0; v < kBrickVoxels; v += 8)
    for (int l = 0; l < 8; ++l) part[l] += r[v + l] * r[v + l];
  double sum = 0.0;
  for (const float p : part) sum += double(p);
  return sum;
}

/// Reads values of a brick. \param all  those of the target's bricks; the others have zeros
void readBrick(std::span<const float> all, std::size_t brick, float* out) {
  if ((brick + 1) * kBrickVoxels <= all.size())
    std::copy_n(all.data() + brick * kBrickVoxels, kBrickVoxels, out);
  else
    std::fill_n(out, kBrickVoxels, 0.0f);
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
  if (!target_.narrowBand) {
    const Box within = target_.within.value_or(bricksOf(Box::whole()));
    index_.append(missingBricks(index_, supports_.size(), supportOf, within));
  }
  pairs_ = pairsWithin(index_, supports_.size(), supportOf);
  moments_.resize(pairs_.pairCount());
}

/// Computes the forms of the current ellipsoids.
void CpuPass::prepare(std::span<const Ellipsoid> ellipsoids) {
  forms_.resize(ellipsoids.size());
  frames_.resize(ellipsoids.size());
  visitEllipsoids(ellipsoids.size(), [&](std::size_t i) {
    const Ellipsoid& p = ellipsoids[i];
    frames_[i] = frameOf(p.center);
    const auto center = inFrame(p.center, frames_[i]);
    forms_[i] = makeLineForm(center, p.L, kernels_.radius(i), p.intensity);
  });
}

/// Reads the target's values of a brick, and starts a sum: r = constants - t.
void CpuPass::startFrom(std::size_t brick, float* t, float* r) const {
  readBrick(target_.values, brick, t);
  for (int v = 0; v < kBrickVoxels; ++v) r[v] = -t[v];
  if (target_.constants.empty()) return;
  alignas(64) float constants[kBrickVoxels];
  readBrick(target_.constants, brick, constants);
  for (int v = 0; v < kBrickVoxels; ++v) r[v] += constants[v];
}

/// Replaces r = V - t by clamp(V, lowest, highest) - t, if the target saturates.
void CpuPass::saturate(const float* t, float* r) const {
  if (!target_.saturates) return;
  const auto low = float(target_.lowest), high = float(target_.highest);
  for (int v = 0; v < kBrickVoxels; ++v) r[v] = std::clamp(r[v], low - t[v], high - t[v]);
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
    const auto i = pairs_.ellipsoid[pair];
    const auto at = cornerIn(frames_[i], corner);
    kernels.backward(forms_[i], at.data(), kernels_.constants(i), byValue,
                     scratch.tapes[pair - begin], moments_[pair]);
  }
}

/// Computes the gradients from the moments of all pairs.
void CpuPass::reduce(std::span<EllipsoidGradient> out) const {
  visitEllipsoids(forms_.size(), [&](std::size_t i) {
    PairSums sums{};
    for (auto k = pairs_.ellipsoidBegin[i]; k != pairs_.ellipsoidBegin[i + 1]; ++k)
      sums.add(moments_[pairs_.pairOf[k]]);
    out[i] = ellipsoidGradient(forms_[i], sums, double(kernels_.constants(i).slope));
  });
}

void CpuPass::residuals(std::span<const Ellipsoid> ellipsoids, std::vector<float>& out) {
  prepare(ellipsoids);
  out.resize(index_.size() * kBrickVoxels);
  visitBricks(index_, [&](std::size_t b) {
    alignas(64) float r[kBrickVoxels], t[kBrickVoxels];
    startFrom(b, t, r);
    const Coord corner = index_.bricks()[b] * kBrickSide;
    for (auto pair = pairs_.brickBegin[b]; pair != pairs_.brickBegin[b + 1]; ++pair) {
      const auto i = pairs_.ellipsoid[pair];
      brickKernels().add(forms_[i], cornerIn(frames_[i], corner).data(), kernels_.constants(i), r);
    }
    saturate(t, r);
    std::copy_n(r, kBrickVoxels, out.data() + b * kBrickVoxels);
  });
}

double CpuPass::gradients(std::span<const Ellipsoid> ellipsoids, std::span<EllipsoidGradient> out) {
  prepare(ellipsoids);
  brickLoss_.resize(index_.size());
  visitBricks(index_, [&](std::size_t b) {
    PairTapes& scratch = tapes_.local();
    alignas(64) float r[kBrickVoxels], t[kBrickVoxels];
    startFrom(b, t, r);
    forward(b, scratch, r);
    saturate(t, r);
    brickLoss_[b] = sumOfSquares(r);
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
