#include "fit/paper/cpu_paper_optimiser.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <utility>

#include "esvr/error.h"
#include "field/gather.h"
#include "fit/cpu/fit_errors.h"
#include "fit/scene.h"

namespace esvr::paper {
namespace {

template <class Visit>
void forEachEllipsoid(std::size_t count, Visit&& visit) {
  tbb::parallel_for(std::size_t(0), count, visit);
}

}  // namespace

CpuPaperOptimiser::CpuPaperOptimiser(const FitTarget& target, const PaperOptions& options)
    : options_(options) {
  const auto kernel = kernelConstants<double>(kernelOf(options.kind));
  const Space space = spaceOf(target);
  for (auto& volume : cutSubvolumes(target, space, options.subvolumeSide)) {
    CpuPass engine(volume->target, kernel);
    parts_.push_back({std::move(volume), std::move(engine)});
  }
}

void CpuPaperOptimiser::put(const Population& population) {
  population_ = population;
  for (Part& part : parts_) part.motionLeft = -1.0;
}

void CpuPaperOptimiser::formEllipsoids() {
  const std::size_t n = population_.size();
  ellipsoids_.resize(n);
  gradients_.resize(n);
  if (options_.kind.learnK) {
    kernels_.constants.resize(n);
    kernels_.radii.resize(n);
  }
  forEachEllipsoid(n, [&](std::size_t i) {
    ellipsoids_[i] = ellipsoidOf(population_.ellipsoids[i], options_.kind);
    if (!options_.kind.learnK) return;
    const auto k = kernelConstants<double>(kernelOf(options_.kind), population_.ellipsoids[i].k);
    kernels_.constants[i] = narrowed(k);
    kernels_.radii[i] = supportRadius(k);
  });
}

void CpuPaperOptimiser::rebuildLists(Part& part, double slack) {
  part.engine.useKernels(options_.kind.learnK ? &kernels_ : nullptr);
  part.engine.rebuild(ellipsoids_, slack);
  part.motionLeft = slack;
}

PaperVector CpuPaperOptimiser::gradientOf(std::size_t i) const {
  return byPaperParameters(population_.ellipsoids[i], ellipsoids_[i], gradients_[i]);
}

double CpuPaperOptimiser::takeGradients(Part& part) {
  const FitTarget& target = part.volume->target;
  part.engine.residuals(ellipsoids_, residuals_);
  const double loss =
      loss_.evaluate({part.engine.index(), residuals_, target.values, target.boxVoxels,
                      options_.beta, target.highest - target.lowest, target.within},
                     lossByValue_);
  part.engine.gradientsOf(ellipsoids_, lossByValue_, gradients_);
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
  const auto& begin = part.engine.pairs().ellipsoidBegin;
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
    pairCount_ += part.engine.pairs().pairCount();
    part.engine.residuals(ellipsoids_, residuals_);
    errors.add(errorsOf(part.volume->target, {part.engine.index(), residuals_}));
  }
  return errors;
}

}  // namespace esvr::paper
