#include "fit/cpu/cpu_pass.h"

#include "fit/scene.h"

namespace esvr {
namespace {

double sumOfSquares(const float* r) {
  // Eight partial float32 sums of 64 terms each are precise enough and allow SIMD.
  float part[8] = {};
  for (int v = 0; v < kBrickVoxels; v += 8)
    for (int l = 0; l < 8; ++l) part[l] += r[v + l] * r[v + l];
  double sum = 0.0;
  for (const float p : part) sum += double(p);
  return sum;
}

}  // namespace

SceneKernel::SceneKernel(const KernelConstants<double>& kernel)
    : exact_(kernel), narrowed_(narrowed(kernel)), radius_(supportRadius(kernel)) {}

double CpuPass::gradients(std::span<const Ellipsoid> ellipsoids, std::span<EllipsoidGradient> out) {
  prepare(ellipsoids);
  brickLoss_.resize(brickCount());
  forEachBrick([&](std::size_t b) {
    PairTapes& scratch = tapes_.local();
    alignas(64) float r[kBrickVoxels], t[kBrickVoxels];
    readTarget(b, t);
    startFrom(b, t, r);
    forwardBrick(b, scratch, r);
    if (target().saturates) saturate(t, r);
    brickLoss_[b] = sumOfSquares(r);
    backwardBrick(b, scratch, r);
  });
  reduce(out);
  double loss = 0.0;
  for (const double l : brickLoss_) loss += l;
  return loss;
}

}  // namespace esvr
