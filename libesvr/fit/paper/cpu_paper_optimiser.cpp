#include "fit/paper/cpu_paper_optimiser.h"

#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "esvr/error.h"
#include "field/gather.h"
#include "fit/cpu/fit_errors.h"
#include "fit/scene.h"

namespace esvr::paper {
namespace {

template <class Visit>
void forEachEllipsoid(std::size_t count, Visit&& visit) {
  parallelFor(std::size_t(0), count, visit);
}

}  // namespace

CpuPaperOptimiser::CpuPaperOptimiser(const FitTarget& target, const PaperOptions& options)
    : options_(options) {
  resizeKernels(1);
  setKernel(0, kernelConstants<double>(kernelOf(options.kind)));
  for (auto& volume : cutSubvolumes(target, spaceOf(target), options.subvolumeSide)) {
    CpuPaperPass pass(volume->target, kernels_);
    parts_.push_back({std::move(volume), std::move(pass)});
  }
}

void CpuPaperOptimiser::put(const Population& population) {
  population_ = population;
  for (Part& part : parts_) part.motionLeft = -1.0;
}

void CpuPaperOptimiser::resizeKernels(std::size_t count) {
  kernels_.all.resize(count);
  kernels_.radii.resize(count);
}

void CpuPaperOptimiser::setKernel(std::size_t i, const KernelConstants<double>& kernel) {
  kernels_.all[i] = narrowed(kernel);
  kernels_.radii[i] = supportRadius(kernel);
}

void CpuPaperOptimiser::formEllipsoids() {
  const std::size_t n = population_.size();
  ellipsoids_.resize(n);
  gradients_.resize(n);
  if (options_.kind.learnK) resizeKernels(n);
  forEachEllipsoid(n, [&](std::size_t i) {
    ellipsoids_[i] = ellipsoidOf(population_.ellipsoids[i], options_.kind);
    if (options_.kind.learnK)
      setKernel(i, kernelConstants<double>(kernelOf(options_.kind), population_.ellipsoids[i].k));
  });
}

void CpuPaperOptimiser::rebuildLists(Part& part, double slack) {
  part.pass.rebuild(ellipsoids_, slack);
  part.motionLeft = slack;
}

PaperVector CpuPaperOptimiser::gradientOf(std::size_t i) const {
  return byPaperParameters(population_.ellipsoids[i], ellipsoids_[i], gradients_[i]);
}

double CpuPaperOptimiser::takeGradients(Part& part) {
  const FitTarget& target = part.volume->target;
  part.pass.residuals(ellipsoids_, residuals_);
  const double loss =
      loss_.evaluate({part.pass.index(), residuals_, target.values, target.boxVoxels, options_.beta,
                      target.highest - target.lowest, target.within},
                     lossByValue_);
  part.pass.gradients(ellipsoids_, lossByValue_, gradients_);
  return loss;
}

LossGradients CpuPaperOptimiser::gradients(std::size_t subvolume) {
  formEllipsoids();
  rebuildLists(parts_[subvolume], kListSlack);
  LossGradients result{takeGradients(parts_[subvolume]), {}};
  for (std::size_t i = 0; i < population_.size(); ++i) result.byEllipsoid.push_back(gradientOf(i));
  return result;
}

void CpuPaperOptimiser::iterate(std::size_t subvolume, const PaperStep& step) {
  Part& part = parts_[subvolume];
  formEllipsoids();
  if (part.motionLeft < 0.0) rebuildLists(part, kListSlack);
  takeGradients(part);
  const auto& begin = part.pass.pairs().ellipsoidBegin;
  forEachEllipsoid(population_.size(), [&](std::size_t i) {
    takeStep(population_.ellipsoids[i], population_.states[i], gradientOf(i),
             begin[i + 1] > begin[i], step);
  });
  for (Part& each : parts_) each.motionLeft -= motionOf(step);
}

FitErrors CpuPaperOptimiser::measure() {
  formEllipsoids();
  for (const Ellipsoid& p : ellipsoids_)
    if (!std::isfinite(p.center[0] + p.L[0] + p.intensity))
      throw RuntimeFailure("the fit diverged: an ellipsoid is not finite");
  FitErrors errors;
  pairCount_ = 0;
  for (Part& part : parts_) {
    rebuildLists(part, kRoundingSlack);
    pairCount_ += part.pass.pairs().pairCount();
    part.pass.residuals(ellipsoids_, residuals_);
    errors.add(errorsOf(part.volume->target, {part.pass.index(), residuals_}));
  }
  return errors;
}

}  // namespace esvr::paper
