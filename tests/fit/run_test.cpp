// Plan: Adam's step is checked for gradients of any size, for a scaled loss, at its limits, and over many steps. Schedules
// start and end at the given values.
//
// An optimiser that does nothing notes when a run grows, relocates and changes kappa. A run in parts must do so at the same
// iterations as a run in one part. The descent on kappa goes against the slope, whatever its size, by at most the largest
// step, stays within its limits, does not move without a slope, and finds the minimum of a convex function.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "fit/adam.h"
#include "fit/run.h"
#include "fit/tuning.h"
#include "volumes.h"

namespace esvr {
namespace {

// Steps.

TEST(Adam, FirstStepHasTheTunedSizeWhateverTheGradient) {
  for (const double size : {1e-25, 1.0, 1e25}) {
    std::vector<Ellipsoid> p{{{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 1.0}};
    std::vector<AdamState> state(1);
    std::vector<EllipsoidGradient> g(1);
    g[0].byParameter.fill(0.0);
    g[0].byParameter[0] = size;
    adamStep(p, state, g, {{0.1, 0.1, 0.1}, {}, {0.25, 64.0, -2.0, 2.0}});
    // Float32 moments round g^2. Below 1e-19 they would underflow, which the target's scale
    // excludes.
    if (size > 1e-19 && size < 1e19) {
      EXPECT_NEAR(p[0].center[0], -0.1, 1e-6);
    }
    EXPECT_TRUE(std::isfinite(p[0].center[0]));
  }
}

TEST(Adam, KeepsIntensitiesInRange) {
  std::vector<Ellipsoid> p{{{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 0.001}};
  std::vector<AdamState> state(1);
  std::vector<EllipsoidGradient> g(1);
  g[0].byParameter.fill(0.0);
  g[0].byParameter[9] = 1.0;
  for (int i = 0; i < 50; ++i) adamStep(p, state, g, {{}, {}, {0.25, 64.0, 0.0, 1.5}});
  EXPECT_EQ(p[0].intensity, 0.0);
}

/// A hundred steps down the bowl |center - (1, 2, 3)|^2 / 2, with a scaled gradient.
std::array<double, 3> descend(double scale) {
  std::vector<Ellipsoid> p{{{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 1.0}};
  std::vector<AdamState> state(1);
  std::vector<EllipsoidGradient> g(1);
  for (int i = 0; i < 100; ++i) {
    g[0].byParameter.fill(0.0);
    for (std::size_t a = 0; a < 3; ++a)
      g[0].byParameter[a] = scale * (p[0].center[a] - double(a + 1));
    adamStep(p, state, g, {{}, {}, {0.25, 64.0, 0.0, 1.5}});
  }
  return p[0].center;
}

TEST(Adam, TakesTheSameWayHoweverTheLossIsScaled) {
  const auto expected = descend(1.0);
  for (const double scale : {1e-6, 1e6}) {
    const auto found = descend(scale);
    // Float32 moments round the scaled gradients differently, by 1e-7 for each step.
    for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(found[a], expected[a], 1e-4);
  }
}

TEST(Adam, LeavesALimitWhenTheGradientPointsBackInside) {
  constexpr double kSmallest = 0.25;
  std::vector<Ellipsoid> p{{{0, 0, 0}, {4, 0, 0, 0, 4, 0, 0, 0, 4}, 1.0}};
  std::vector<AdamState> state(1);
  std::vector<EllipsoidGradient> g(1);
  g[0].byParameter.fill(0.0);
  const auto push = [&](double gradient, int steps) {
    for (int k = 3; k < 6; ++k) g[0].byParameter[std::size_t(k)] = gradient;
    for (int i = 0; i < steps; ++i) adamStep(p, state, g, {{}, {}, {kSmallest, 64.0, 0.0, 1.5}});
    return principalAxes(p[0].L).scale[2];
  };
  EXPECT_NEAR(push(1.0, 30), kSmallest, 1e-9);  // shrinks until the limit holds it
  EXPECT_GT(push(-1.0, 60), 2 * kSmallest);
}

TEST(Adam, SlowKeepsAShapeValidOverAHundredThousandSteps) {
  test::Random random(11);
  std::vector<Ellipsoid> p{{{0, 0, 0}, {1, 0, 0, 0, 0.5, 0, 0, 0, 2}, 1.0}};
  std::vector<AdamState> state(1);
  std::vector<EllipsoidGradient> g(1);
  for (int i = 0; i < 100'000; ++i) {
    for (double& value : g[0].byParameter) value = random(-1.0, 1.0);
    adamStep(p, state, g, {{}, {}, {0.25, 16.0, 0.0, 1.5}});
  }
  const PrincipalAxes axes = principalAxes(p[0].L);
  double norm2 = 0.0;
  for (const double q : axes.rotation) norm2 += q * q;
  EXPECT_NEAR(norm2, 1.0, 1e-12);
  EXPECT_GE(axes.scale[2], 0.25 * (1 - 1e-6));  // the precision of the closed-form eigensolver
  EXPECT_LE(axes.scale[0], 16.0 * (1 + 1e-6));
}

TEST(Schedule, GoesFromItsFirstCountToItsLast) {
  const Tuning tuning;
  const Schedule schedule{100, 1000, 500, tuning};
  EXPECT_EQ(schedule.countAt(0.0), 100u);
  EXPECT_EQ(schedule.countAt(tuning.growUntil), 1000u);
  EXPECT_EQ(schedule.countAt(1.0), 1000u);
  EXPECT_GT(schedule.stepAt(0.5, 250), tuning.finalStep);
  EXPECT_EQ(schedule.stepAt(1.0, 499), 0.0);
  EXPECT_EQ(schedule.relocationsAt(1.0, 1000), 0u);
}

// Runs.

constexpr std::uint32_t kIterations = 300;  // some events are at the ends of parts

/// The iterations at which a run called a function of its optimiser.
struct Calls {
  std::vector<std::uint32_t> relocate, grow, kappa;
  friend bool operator==(const Calls&, const Calls&) = default;
};

class NotingOptimiser : public Optimiser {
 public:
  NotingOptimiser(std::uint32_t first, Calls& calls) : iteration_(first), calls_(calls) {}

  void setState(const FitState&) override {}
  [[nodiscard]] FitState state() const override { return {}; }
  void setEllipsoids(std::span<const Ellipsoid>) override {}
  void growTo(std::size_t) override { calls_.grow.push_back(iteration_); }
  void relocate(std::size_t count) override {
    if (count > 0) calls_.relocate.push_back(iteration_);
  }
  double iterate(std::span<const double> factors) override {
    iteration_ += std::uint32_t(factors.size());
    return 1.0;
  }
  [[nodiscard]] std::uint32_t batchSize() const override { return 8; }
  [[nodiscard]] FitErrors measure() override { return {}; }
  [[nodiscard]] const Kernel& kernel() const override { return kernel_; }
  [[nodiscard]] double kappaSlope() override { return 1.0; }
  void setKappa(float) override { calls_.kappa.push_back(iteration_); }
  void dropUnseen() override {}
  [[nodiscard]] std::size_t ellipsoidCount() const override { return 1000; }
  [[nodiscard]] std::vector<Ellipsoid> ellipsoids() const override { return {}; }
  [[nodiscard]] std::uint64_t pairCount() const override { return 0; }
  [[nodiscard]] std::size_t deviceBytes() const override { return 0; }
  [[nodiscard]] double secondsSeeding() const override { return 0.0; }

 private:
  std::uint32_t iteration_;
  Calls& calls_;
  Kernel kernel_;
};

void runPart(double from, double to, Calls& calls) {
  const FitTarget target;
  const CommonFitOptions options;
  Recorder recorder(target, options);
  RunPlan plan;
  plan.firstCount = 100;
  plan.count = 1000;
  plan.iterations = kIterations;
  plan.learnKappa = true;
  plan.from = from;
  plan.to = to;
  NotingOptimiser optimiser(std::uint32_t(from * kIterations), calls);
  (void)run(optimiser, target, recorder, plan, Tuning{});
}

TEST(Run, InPartsHasTheEventsOfARunInOnePart) {
  Calls whole, parts;
  runPart(0.0, 1.0, whole);
  constexpr std::array kEnds{0.0, 0.1, 0.25, 0.5, 0.7, 1.0};
  for (std::size_t part = 1; part < kEnds.size(); ++part)
    runPart(kEnds[part - 1], kEnds[part], parts);
  EXPECT_FALSE(whole.relocate.empty());
  EXPECT_EQ(parts, whole);
}

TEST(KappaDescent, StepsAgainstTheSlopeWhateverItsSize) {
  for (const double size : {1e-12, 1.0, 1e12}) {
    EXPECT_FLOAT_EQ(KappaDescent(0.1).next(2.0f, size, 1.0), 1.9f);
    EXPECT_FLOAT_EQ(KappaDescent(0.1).next(2.0f, -size, 0.5), 2.05f);
  }
}

TEST(KappaDescent, StaysWithoutASlope) { EXPECT_EQ(KappaDescent(0.1).next(2.0f, 0.0, 1.0), 2.0f); }

TEST(KappaDescent, KeepsToItsBounds) {
  KappaDescent down(10.0), up(10.0);
  float low = 0.0f, high = 0.0f;
  for (int i = 0; i < 10; ++i) {
    low = down.next(low, 1.0, 1.0);
    high = up.next(high, -1.0, 1.0);
  }
  EXPECT_EQ(low, float(KappaDescent::kSmoothest));
  EXPECT_EQ(high, float(KappaDescent::kHardest));
}

TEST(KappaDescent, FindsAValley) {
  KappaDescent descent(0.1);
  float kappa = -2.0f;
  const int steps = 200;
  for (int i = 0; i < steps; ++i)
    kappa = descent.next(kappa, 1e-5 * (double(kappa) - 3.0), 1.0 - double(i) / steps);
  EXPECT_NEAR(kappa, 3.0f, 0.02f);  // the last steps are shorter than 0.01
}

}  // namespace
}  // namespace esvr
