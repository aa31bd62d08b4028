// Plan: an optimiser that does nothing notes when a run grows, relocates and changes kappa. A run
// in parts must do so at the same iterations as a run in one part. The descent on kappa goes against
// the slope, whatever its size, by at most the largest step, stays within its limits, does not move
// without a slope, and finds the minimum of a convex function.

#include "fit/run.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

namespace esvr {
namespace {

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
