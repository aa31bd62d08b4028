// Plan: on every device, the gradient of the paper's loss over one subvolume by every parameter of
// the paper (position, log scales, quaternion of any length, intensity, k) is compared with central
// differences of a float64 loss by the paper's formula at every voxel, with SSIM by its definition.
// The cases are the paper's ellipsoids, Gaussians, and ellipsoids of different k. The paper's
// ellipsoid and the form that passes use are the same function. A GPU that holds one subvolume at a
// time computes the same bits.

#include <cmath>
#include <optional>

#include "../random_ellipsoids.h"
#include "dense_paper_loss.h"
#include "fit/paper/paper_optimiser.h"
#include "support/on_device.h"

namespace esvr::paper {
namespace {

constexpr int kSubvolume = 7;  // the last of 2 x 2 x 2 subvolumes, each a brick
const Box kBrick{{8, 8, 8}, {15, 15, 15}};

SparseVolume smallVolume() {
  test::Random random(3);
  std::vector<BrickInput> bricks;
  for (int b = 0; b < 8; ++b) {
    BrickInput brick;
    brick.corner = Coord{b / 4, b / 2 % 2, b % 2} * kBrickSide;
    for (float& v : brick.values) v = float(random(0.0, 1.0));
    brick.active.setAll();
    bricks.push_back(brick);
  }
  return makeVolume(std::move(bricks), 0.0f);
}

Population fewEllipsoids() {
  Population population;
  population.ellipsoids = {{{11.3, 12.1, 10.7}, {1.1, 0.4, -0.2}, {0.9, 0.2, -0.4, 0.3}, 0.6, 5.0},
                           {{9.1, 9.7, 13.2}, {0.5, 1.2, 0.3}, {1.7, -0.3, 0.8, 0.1}, 0.3, 3.2},
                           {{6.4, 14.8, 9.9}, {1.0, 1.0, 1.3}, {0.2, 0.3, 0.1, -0.2}, -0.2, 7.5}};
  population.states.resize(population.size());
  return population;
}

/// The paper's eq. 5, or a Gaussian that ends at 3 sigma, shifted so that it ends at 0.
double kernelAt(double q, double k, bool gaussian) {
  const auto sigma = [](double x) { return 1.0 / (1.0 + std::exp(-x)); };
  if (gaussian) {
    const double end = double(float(std::exp(-4.5)));
    return std::max(0.0, (std::exp(-0.5 * q) - end) / (1.0 - end));
  }
  const auto phi = [&](double of, double at) { return sigma(of * (1.0 - at)) / sigma(of); };
  const double last = phi(5.0, double(Kernel::kPaperCutoff) * double(Kernel::kPaperCutoff));
  return phi(k, q) > last ? phi(k, q) : 0.0;
}

double squaredDistance(const PaperEllipsoid& p, Coord v) {
  const Matrix3 R = rotationOf(normalised(p.rotation));
  const double d[3] = {v.x - p.center[0], v.y - p.center[1], v.z - p.center[2]};
  double q = 0.0;
  for (int j = 0; j < 3; ++j) {
    const double along = R[j] * d[0] + R[3 + j] * d[1] + R[6 + j] * d[2];
    q += std::pow(along * std::exp(-p.logScale[j]), 2);
  }
  return q;
}

class DenseLoss {
 public:
  DenseLoss(const FitTarget& target, const KernelKind& kind, double beta)
      : kind_(kind), target_(paddedBrick()) {
    options_ = {kBrick.volume(), beta, target.highest - target.lowest, kBrick};
    forEachVoxel([&](Coord v) {
      target_[v] =
          double(target.values[kSubvolume * kBrickVoxels + std::size_t(voxelOffset(localOf(v)))]);
    });
  }
  [[nodiscard]] double operator()(const Population& population) const {
    test::DenseValues prediction(paddedBrick());
    forEachVoxel([&](Coord v) {
      for (const PaperEllipsoid& p : population.ellipsoids)
        prediction[v] += p.intensity * kernelAt(squaredDistance(p, v), kind_.learnK ? p.k : kind_.k,
                                                kind_.gaussian);
    });
    return test::densePaperLoss(prediction, target_, options_);
  }

 private:
  static Box paddedBrick() { return {Coord{3, 3, 3}, Coord{20, 20, 20}}; }
  template <class Visit>
  static void forEachVoxel(Visit&& visit) {
    for (int v = 0; v < kBrickVoxels; ++v) visit(kBrick.min + voxelLocal(v));
  }
  KernelKind kind_;
  test::DenseValues target_;
  test::DenseLossOptions options_{};
};

double& parameter(PaperEllipsoid& p, int n) {
  if (n < 3) return p.center[n];
  if (n < 6) return p.logScale[n - 3];
  if (n < 10) return p.rotation[n - 6];
  return n == 10 ? p.intensity : p.k;
}

class PaperGradientOn : public test::OnDevice {
 protected:
  // The loss is of order 1 in float64, so differences with a step of 1e-6 have errors of about
  // 1e-10, for gradients of 1e-3. The step is so small because the paper's kernel jumps at its end.
  // The gradient is a float32 sum over a brick's voxels, with an exponential precise to 1e-6 on the
  // GPU.
  void expectDifferences(const KernelKind& kind) const {
    constexpr double kStep = 1e-6, kTolerance = 1e-4, kBeta = 0.2;
    const SparseVolume volume = smallVolume();
    const FitTarget target = makeTarget(volume, std::nullopt);
    const auto optimiser = makePaperOptimiser(target, {.kind = kind,
                                                       .beta = kBeta,
                                                       .subvolumeSide = kBrickSide,
                                                       .device = device_,
                                                       .maxDeviceBytes = {},
                                                       .visitOnly = false});
    ASSERT_EQ(optimiser->subvolumeCount(), 8u);
    const Population population = fewEllipsoids();
    optimiser->put(population);
    const LossGradients found = optimiser->gradients(kSubvolume);
    const DenseLoss loss(target, kind, kBeta);
    EXPECT_NEAR(found.loss, loss(population), 1e-5);
    for (std::size_t i = 0; i < population.size(); ++i) {
      double error = 0.0, norm = 0.0;
      for (int n = 0; n < kPaperParameters; ++n) {
        if (n == kPaperParameters - 1 && !kind.learnK) continue;
        const auto lossAt = [&](double step) {
          Population moved = population;
          parameter(moved.ellipsoids[i], n) += step;
          return loss(moved);
        };
        const double difference = (lossAt(kStep) - lossAt(-kStep)) / (2.0 * kStep);
        error += std::pow(found.byEllipsoid[i][n] - difference, 2);
        norm += difference * difference;
      }
      EXPECT_LT(std::sqrt(error), kTolerance * std::sqrt(norm)) << "ellipsoid " << i;
    }
  }
};

TEST_P(PaperGradientOn, SlowOfThePapersEllipsoidAgreesWithDifferences) { expectDifferences({}); }
TEST_P(PaperGradientOn, SlowOfGaussiansAgreesWithDifferences) {
  expectDifferences({.gaussian = true});
}
TEST_P(PaperGradientOn, SlowOfOwnKAgreesWithDifferences) { expectDifferences({.learnK = true}); }

TEST_P(PaperGradientOn, IsTheSameWhereOnlyTheVisitedSubvolumeIsThere) {
  const SparseVolume volume = smallVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  PaperOptions options{.kind = {},
                       .beta = 0.2,
                       .subvolumeSide = kBrickSide,
                       .device = device_,
                       .maxDeviceBytes = {},
                       .visitOnly = false};
  const auto all = makePaperOptimiser(target, options);
  options.visitOnly = true;
  const auto visited = makePaperOptimiser(target, options);
  PaperStep step;
  step.rates.fill(1e-3);
  step.smallestLogScale = -3.0, step.largestLogScale = 3.0;
  for (PaperOptimiser* optimiser : {all.get(), visited.get()}) {
    optimiser->put(fewEllipsoids());
    for (std::size_t s = 0; s < optimiser->subvolumeCount(); ++s) optimiser->iterate(s, step);
  }
  EXPECT_EQ(all->measure().squaredSum, visited->measure().squaredSum);
  EXPECT_EQ(all->gradients(kSubvolume).byEllipsoid, visited->gradients(kSubvolume).byEllipsoid);
}

ESVR_ON_DEVICES(PaperGradientOn);

TEST(PaperEllipsoid, IsTheSameFunctionInBothForms) {
  for (const KernelKind kind :
       {KernelKind{}, KernelKind{.gaussian = true}, KernelKind{.learnK = true}})
    for (const PaperEllipsoid& p : fewEllipsoids().ellipsoids) {
      const Ellipsoid unit = ellipsoidOf(p, kind);
      const auto kernel =
          kernelConstants<double>(kernelOf(kind), kind.learnK ? p.k : double(kernelOf(kind).kappa));
      for (const Coord v : {Coord{11, 12, 10}, Coord{9, 11, 12}, Coord{8, 14, 9}}) {
        const double d[3] = {v.x - p.center[0], v.y - p.center[1], v.z - p.center[2]};
        double m = 0.0;
        for (int r = 0; r < 3; ++r)
          m += std::pow(unit.L[3 * r] * d[0] + unit.L[3 * r + 1] * d[1] + unit.L[3 * r + 2] * d[2],
                        2);
        EXPECT_NEAR(kernelPhi(kernel, m),
                    kernelAt(squaredDistance(p, v), kind.learnK ? p.k : kind.k, kind.gaussian),
                    1e-12);
      }
    }
}

}  // namespace
}  // namespace esvr::paper
