#include "fit/paper/paper_optimiser.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "esvr/error.h"
#include "field/evaluate.h"
#include "fit/cpu/cpu_pass.h"
#include "fit/cpu/residual.h"
#include "fit/cuda/make_cuda.h"
#include "fit/paper/paper_loss.h"

namespace esvr::paper {

// --- The subvolumes.

namespace {

Coord sides(const Box& box) { return box.max - box.min + Coord{1, 1, 1}; }

int bricksAcross(int voxels) { return std::max(1, (voxels + kBrickSide - 1) / kBrickSide); }

std::unique_ptr<Subvolume> emptySubvolume(const FitTarget& whole, const Box& bricks) {
  auto part = std::make_unique<Subvolume>();
  FitTarget& t = part->target;
  t.scale = whole.scale;
  t.box = whole.box;
  t.boxVoxels = bricks.volume() * kBrickVoxels;
  t.peak = whole.peak;
  t.lowest = whole.lowest;
  t.highest = whole.highest;
  t.within = bricks;
  t.active = &part->active;
  return part;
}

void addBrick(Subvolume& part, const FitTarget& whole, std::size_t b) {
  const auto* values = whole.values.data() + b * kBrickVoxels;
  part.target.bricks.push_back(whole.bricks[b]);
  part.target.values.insert(part.target.values.end(), values, values + kBrickVoxels);
  part.active.push_back((*whole.active)[b]);
  part.target.activeVoxels += std::uint64_t(part.active.back().count());
}

}  // namespace

int Space::longestAxis() const {
  const Coord s = sides(bricks);
  return std::max({s.x, s.y, s.z}) * kBrickSide;
}

int Space::shortestAxis() const {
  const Coord s = sides(bricks);
  return std::min({s.x, s.y, s.z}) * kBrickSide;
}

Box Space::voxels() const {
  return {bricks.min * kBrickSide, (bricks.max + Coord{1, 1, 1}) * kBrickSide - Coord{1, 1, 1}};
}

Space spaceOf(const FitTarget& target) {
  Space space;
  if (!target.box.empty()) space.bricks = {brickOf(target.box.min), brickOf(target.box.max)};
  for (const Coord brick : target.bricks) space.bricks.expand(brick);
  return space;
}

int subvolumeSide(const Space& space, int asked) {
  const int side = asked > 0 ? asked : std::min(space.longestAxis() / 2, space.shortestAxis());
  return bricksAcross(side) * kBrickSide;
}

std::vector<std::unique_ptr<Subvolume>> cutSubvolumes(const FitTarget& target, const Space& space,
                                                      int side) {
  const int step = bricksAcross(side);
  const Coord first = space.bricks.min;
  const auto parts = [&](int bricks) { return (bricks + step - 1) / step; };
  const Coord all = sides(space.bricks);
  const Coord count{parts(all.x), parts(all.y), parts(all.z)};
  std::vector<std::unique_ptr<Subvolume>> result;
  for (int x = 0; x < count.x; ++x)
    for (int y = 0; y < count.y; ++y)
      for (int z = 0; z < count.z; ++z) {
        const Coord low = first + Coord{x, y, z} * step;
        const Coord high = minCoord(low + Coord{step - 1, step - 1, step - 1}, space.bricks.max);
        result.push_back(emptySubvolume(target, {low, high}));
      }
  for (std::size_t b = 0; b < target.bricks.size(); ++b) {
    const Coord place = target.bricks[b] - first;
    const int n = (place.x / step * count.y + place.y / step) * count.z + place.z / step;
    addBrick(*result[std::size_t(n)], target, b);
  }
  return result;
}

// --- The optimiser on the CPU.

namespace {

class CpuPaperOptimiser final : public PaperOptimiser {
 public:
  CpuPaperOptimiser(const FitTarget& target, const PaperOptions& options);

  [[nodiscard]] std::size_t subvolumeCount() const override { return parts_.size(); }
  void iterate(std::size_t subvolume, const PaperStep& step) override;
  [[nodiscard]] LossGradients gradients(std::size_t subvolume) override;
  void put(const Population& population) override;
  [[nodiscard]] Population population() const override { return population_; }
  [[nodiscard]] std::size_t ellipsoidCount() const override { return population_.size(); }
  [[nodiscard]] FitErrors measure() override;
  [[nodiscard]] std::uint64_t pairCount() const override { return pairCount_; }
  [[nodiscard]] std::size_t deviceBytes() const override { return 0; }

 private:
  struct Part {
    std::unique_ptr<Subvolume> volume;
    CpuPass pass;
    double motionLeft = -1.0;  ///< voxels by which supports may still move; < 0: lists are outdated
  };

  void formEllipsoids();
  void rebuildLists(Part& part, double slack);
  double takeGradients(Part& part);
  [[nodiscard]] PaperVector gradientOf(std::size_t ellipsoid) const;

  PaperOptions options_;
  PassKernels kernels_;
  std::vector<Part> parts_;
  Population population_;
  std::vector<Ellipsoid> ellipsoids_;  ///< the population in the form of the passes
  std::vector<EllipsoidGradient> gradients_;
  std::vector<float> residuals_, lossByValue_;
  PaperLoss loss_;
  std::uint64_t pairCount_ = 0;
};

CpuPaperOptimiser::CpuPaperOptimiser(const FitTarget& target, const PaperOptions& options)
    : options_(options), kernels_(kernelConstants<double>(kernelOf(options.kind))) {
  for (auto& volume : cutSubvolumes(target, spaceOf(target), options.subvolumeSide)) {
    const FitTarget& part = volume->target;
    parts_.push_back({std::move(volume), CpuPass(part, kernels_)});
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
  if (options_.kind.learnK) kernels_.resize(n);
  parallelFor(std::size_t(0), n, [&](std::size_t i) {
    ellipsoids_[i] = ellipsoidOf(population_.ellipsoids[i], options_.kind);
    if (options_.kind.learnK)
      kernels_.set(i, constantsOf(population_.ellipsoids[i], options_.kind));
  });
}

void CpuPaperOptimiser::rebuildLists(Part& part, double slack) {
  part.pass.setKernels(kernels_);
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
  if (options_.kind.learnK) part.pass.setKernels(kernels_);
  takeGradients(part);
  const auto& begin = part.pass.pairs().ellipsoidBegin;
  parallelFor(std::size_t(0), population_.size(), [&](std::size_t i) {
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

}  // namespace

std::unique_ptr<PaperOptimiser> makePaperOptimiser(const FitTarget& target,
                                                   const PaperOptions& options) {
  if (options.device.kind == DeviceKind::kCuda) return makeCudaPaperOptimiser(target, options);
  return std::make_unique<CpuPaperOptimiser>(target, options);
}

}  // namespace esvr::paper
