#include "fit/cpu/cpu_pass.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "fit/frame.h"
#include "fit/parameter_gradient.h"
#include "fit/scene.h"

namespace esvr {
namespace {

using Range = tbb::blocked_range<std::size_t>;
constexpr std::size_t kBrickGrain = 4, kEllipsoidGrain = 64;

double sumOfSquares(const float* r) {
  // Eight partial sums in float32 over 64 terms each, then float64: enough for any loss, and SIMD.
  float part[8] = {};
  for (int v = 0; v < kBrickVoxels; v += 8)
    for (int l = 0; l < 8; ++l) part[l] += r[v + l] * r[v + l];
  double sum = 0.0;
  for (const float p : part) sum += double(p);
  return sum;
}

}  // namespace

CpuPass::CpuPass(const FitTarget& target, const KernelConstants<double>& kernel)
    : target_(target), index_(target.bricks) {
  setKernel(kernel);
}

void CpuPass::setKernel(const KernelConstants<double>& kernel) {
  kernel_ = kernel;
  kernelFloat_ = narrowed(kernel);
  radius_ = supportRadius(kernel);
}

void CpuPass::rebuild(std::span<const Ellipsoid> ellipsoids, double slack) {
  std::vector<Support> reach(ellipsoids.size());
  tbb::parallel_for(Range(0, ellipsoids.size(), kEllipsoidGrain), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      reach[i] = makeSupport(ellipsoids[i].center, ellipsoids[i].L, radiusOf(i), slack);
  });
  const auto supportOf = [&](std::size_t i) -> const Support& { return reach[i]; };
  index_ = BrickIndex(target_.bricks);
  if (!target_.narrowBand) {
    auto reached = missingBricks(index_, ellipsoids.size(), supportOf);
    if (target_.within)
      std::erase_if(reached, [&](Coord brick) { return !target_.within->contains(brick); });
    index_.append(reached);
  }
  pairs_ = pairsWithin(index_, ellipsoids.size(), supportOf);
  moments_.resize(pairs_.pairCount());
  brickLoss_.resize(index_.size());
}

void CpuPass::prepare(std::span<const Ellipsoid> ellipsoids) {
  forms_.resize(ellipsoids.size());
  frames_.resize(ellipsoids.size());
  tbb::parallel_for(Range(0, ellipsoids.size(), kEllipsoidGrain), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Ellipsoid& p = ellipsoids[i];
      frames_[i] = frameOf(p.center);
      forms_[i] = makeLineForm(inFrame(p.center, frames_[i]), p.L, radiusOf(i), p.intensity);
    }
  });
}

void CpuPass::startFromTarget(std::size_t brick, float* r) const {
  if (brick >= target_.bricks.size()) {
    std::fill_n(r, kBrickVoxels, 0.0f);
    return;
  }
  const float* t = target_.values.data() + brick * kBrickVoxels;
  for (int v = 0; v < kBrickVoxels; ++v) r[v] = -t[v];
}

/// r = clamp(V, lowest, highest) - target: a narrow band's ends stand for all that is beyond.
void CpuPass::saturate(std::size_t brick, float* r) const {
  const float* t = target_.values.data() + brick * kBrickVoxels;
  const auto low = float(target_.lowest), high = float(target_.highest);
  for (int v = 0; v < kBrickVoxels; ++v) r[v] = std::clamp(r[v], low - t[v], high - t[v]);
}

void CpuPass::forwardBrick(std::size_t brick, PairTapes& scratch, float* r) const {
  const auto begin = pairs_.brickBegin[brick], end = pairs_.brickBegin[brick + 1];
  const Coord corner = index_.bricks()[brick] * kBrickSide;
  const BrickKernels& kernels = brickKernels();
  scratch.reserve(end - begin);
  float* phi = scratch.phi.get();
  for (auto pair = begin; pair != end; ++pair) {
    const auto i = pairs_.ellipsoid[pair];
    PairTape& tape = scratch.tapes[pair - begin];
    tape.phi = phi;
    const auto at = cornerIn(frames_[i], corner);
    kernels.forward(forms_[i], at.data(), kernelOf(i), r, tape);
    phi += tape.floats;
  }
}

void CpuPass::backwardBrick(std::size_t brick, const PairTapes& scratch, const float* r) {
  const auto begin = pairs_.brickBegin[brick], end = pairs_.brickBegin[brick + 1];
  const Coord corner = index_.bricks()[brick] * kBrickSide;
  const BrickKernels& kernels = brickKernels();
  for (auto pair = begin; pair != end; ++pair) {
    const auto i = pairs_.ellipsoid[pair];
    const auto at = cornerIn(frames_[i], corner);
    kernels.backward(forms_[i], at.data(), kernelOf(i), r, scratch.tapes[pair - begin],
                     moments_[pair]);
  }
}

void CpuPass::reduce(std::span<const Ellipsoid> ellipsoids,
                     std::span<EllipsoidGradient> out) const {
  tbb::parallel_for(Range(0, ellipsoids.size(), kEllipsoidGrain), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      PairSums sums{};
      for (auto k = pairs_.ellipsoidBegin[i]; k != pairs_.ellipsoidBegin[i + 1]; ++k)
        sums.add(moments_[pairs_.pairOf[k]]);
      out[i] = ellipsoidGradient(forms_[i], sums, double(kernelOf(i).slope));
    }
  });
}

double CpuPass::gradients(std::span<const Ellipsoid> ellipsoids, std::span<EllipsoidGradient> out) {
  prepare(ellipsoids);
  tbb::enumerable_thread_specific<PairTapes> scratches;
  tbb::parallel_for(Range(0, brickCount(), kBrickGrain), [&](const Range& range) {
    PairTapes& scratch = scratches.local();
    alignas(64) float r[kBrickVoxels];
    for (std::size_t b = range.begin(); b != range.end(); ++b) {
      startFromTarget(b, r);
      forwardBrick(b, scratch, r);
      if (target_.narrowBand) saturate(b, r);
      brickLoss_[b] = sumOfSquares(r);
      backwardBrick(b, scratch, r);
    }
  });
  reduce(ellipsoids, out);
  double loss = 0.0;
  for (const double l : brickLoss_) loss += l;
  return loss;
}

void CpuPass::gradientsOf(std::span<const Ellipsoid> ellipsoids, std::span<const float> lossByValue,
                          std::span<EllipsoidGradient> out) {
  prepare(ellipsoids);
  tbb::enumerable_thread_specific<PairTapes> scratches;
  tbb::parallel_for(Range(0, brickCount(), kBrickGrain), [&](const Range& range) {
    PairTapes& scratch = scratches.local();
    alignas(64) float sum[kBrickVoxels];
    for (std::size_t b = range.begin(); b != range.end(); ++b) {
      forwardBrick(b, scratch, sum);
      backwardBrick(b, scratch, lossByValue.data() + b * kBrickVoxels);
    }
  });
  reduce(ellipsoids, out);
}

void CpuPass::residuals(std::span<const Ellipsoid> ellipsoids, std::vector<float>& out) {
  prepare(ellipsoids);
  out.resize(brickCount() * kBrickVoxels);
  tbb::parallel_for(Range(0, brickCount(), kBrickGrain), [&](const Range& range) {
    const BrickKernels& kernels = brickKernels();
    alignas(64) float r[kBrickVoxels];
    for (std::size_t b = range.begin(); b != range.end(); ++b) {
      startFromTarget(b, r);
      const Coord corner = index_.bricks()[b] * kBrickSide;
      for (auto pair = pairs_.brickBegin[b]; pair != pairs_.brickBegin[b + 1]; ++pair) {
        const auto i = pairs_.ellipsoid[pair];
        kernels.add(forms_[i], cornerIn(frames_[i], corner).data(), kernelOf(i), r);
      }
      if (target_.narrowBand) saturate(b, r);
      std::copy_n(r, kBrickVoxels, out.data() + b * kBrickVoxels);
    }
  });
}

}  // namespace esvr
