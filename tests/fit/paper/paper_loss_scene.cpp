#include "fit/paper/paper_loss_scene.h"

#include <array>

namespace esvr::test {
namespace {

std::array<double, 11> windowWeights() {
  std::array<double, 11> weights;
  double sum = 0.0;
  for (int d = -5; d <= 5; ++d) sum += weights[d + 5] = std::exp(-d * d / (2.0 * 1.5 * 1.5));
  for (double& weight : weights) weight /= sum;
  return weights;
}

DenseValues filteredAlong(const DenseValues& values, Coord axis) {
  const auto weights = windowWeights();
  DenseValues sums(values.box());
  forEachVoxel(values.box(), [&](Coord v) {
    for (int d = -5; d <= 5; ++d) sums[v] += weights[d + 5] * values.at(v + axis * d);
  });
  return sums;
}

DenseValues filtered(const DenseValues& values) {
  return filteredAlong(filteredAlong(filteredAlong(values, {0, 0, 1}), {0, 1, 0}), {1, 0, 0});
}

DenseValues product(const DenseValues& a, const DenseValues& b) {
  DenseValues result(a.box());
  forEachVoxel(a.box(), [&](Coord v) { result[v] = a.at(v) * b.at(v); });
  return result;
}

/// SSIM = a1 a2 / (b1 b2) at one voxel, as in the textbook.
struct Ssim {
  double m1, mt, a1, a2, b1, b2;

  [[nodiscard]] double value() const { return a1 * a2 / (b1 * b2); }
  [[nodiscard]] double byM1() const {
    return 2 * mt * (a2 - a1) / (b1 * b2) - value() * (2 * m1 / b1 - 2 * m1 / b2);
  }
  [[nodiscard]] double byM2() const { return -value() / b2; }
  [[nodiscard]] double byM12() const { return 2 * a1 / (b1 * b2); }
};

class SsimMap {
 public:
  SsimMap(const DenseValues& p, const DenseValues& t, double peak)
      : p_(filtered(p)),
        t_(filtered(t)),
        pp_(filtered(product(p, p))),
        tt_(filtered(product(t, t))),
        pt_(filtered(product(p, t))),
        c1_(std::pow(0.01 * peak, 2)),
        c2_(std::pow(0.03 * peak, 2)) {}

  [[nodiscard]] Ssim at(Coord v) const {
    const double m1 = p_.at(v), mt = t_.at(v);
    return {m1,
            mt,
            2 * m1 * mt + c1_,
            2 * (pt_.at(v) - m1 * mt) + c2_,
            m1 * m1 + mt * mt + c1_,
            pp_.at(v) - m1 * m1 + tt_.at(v) - mt * mt + c2_};
  }

 private:
  DenseValues p_, t_, pp_, tt_, pt_;
  double c1_, c2_;
};

}  // namespace

double densePaperLoss(const DenseValues& p, const DenseValues& t, const DenseLossOptions& options) {
  const SsimMap ssim(p, t, options.peak);
  double absolute = 0.0, dissimilar = 0.0;
  forEachVoxel(p.box(), [&](Coord v) {
    absolute += std::abs(p.at(v) - t.at(v));
    if (options.counts(v)) dissimilar += 1.0 - ssim.at(v).value();
  });
  return (options.beta * absolute / options.peak + (1.0 - options.beta) * dissimilar) /
         options.voxels;
}

DenseValues densePaperLossGradient(const DenseValues& p, const DenseValues& t,
                                   const DenseLossOptions& options) {
  const SsimMap ssim(p, t, options.peak);
  DenseValues byM1(p.box()), byM2(p.box()), byM12(p.box()), gradient(p.box());
  forEachVoxel(p.box(), [&](Coord v) {
    if (!options.counts(v)) return;
    const Ssim s = ssim.at(v);
    byM1[v] = s.byM1();
    byM2[v] = s.byM2();
    byM12[v] = s.byM12();
  });
  byM1 = filtered(byM1);
  byM2 = filtered(byM2);
  byM12 = filtered(byM12);
  forEachVoxel(p.box(), [&](Coord v) {
    const double r = p.at(v) - t.at(v);
    const double byAbsolute = double((r > 0.0) - (r < 0.0)) / options.peak;
    const double bySsim = byM1.at(v) + 2.0 * p.at(v) * byM2.at(v) + t.at(v) * byM12.at(v);
    gradient[v] = (options.beta * byAbsolute - (1.0 - options.beta) * bySsim) / options.voxels;
  });
  return gradient;
}

}  // namespace esvr::test
