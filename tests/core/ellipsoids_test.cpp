// Plan: kernelPhi, its derivatives by the constants' slope, and the constants, in float and double,
// are compared with
//  - the definition in ellipsoids.h, typed as it stands there, in long double (whose range holds
//  e^1e4);
//  - central differences of that definition, and its closed derivative by kappa where differences
//    drown in rounding;
//  - the paper's formula and the Gaussian, which are members of the family;
// from kappa = -30, a Gaussian, to 5000, a step.
//
// Tolerances. With t = m - s, phi = A / (B + e^t) - base. Rounding t and e^t changes phi by at most
// (|t| + 1) u e^t / (B + e^t) times a quotient that is at most 1 / (1 - eps). Where e^t / (B + e^t)
// is not tiny, t < 5.2, since the support ends there; this gives 6.2 u. The constants, the sum, the
// quotient and the difference add 4 u. With u = epsilon / 2 the total is 5.1 epsilon, rounded up to
// 8.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "esvr/ellipsoids.h"

namespace esvr {
namespace {

template <class Real>
constexpr double kRounding = 8.0 * double(std::numeric_limits<Real>::epsilon());

constexpr long double kEps = Kernel::kDefaultEpsilon;

long double definition(long double kappa, long double m) {
  const long double e = std::exp(kappa);
  return ((1 + e) / (e + std::exp(m)) - kEps) / (1 - kEps);
}

long double definitionByKappa(long double kappa, long double m) {
  const long double e = std::exp(kappa);
  const long double denominator = e + std::exp(m);
  return e * std::expm1(m) / (denominator * denominator) / (1 - kEps);
}

long double definitionOfCutoff(long double kappa) {
  const long double e = std::exp(kappa);
  return std::log((1 + e) / kEps - e);
}

Kernel kernelOf(float kappa) { return {.kappa = kappa}; }

/// Values of m inside the support that are exact in float: equal steps, and finer ones at the edge.
std::vector<float> samples(float kappa) {
  const auto end = float(definitionOfCutoff(kappa));
  std::vector<float> ms{0.0f, 1e-30f, 1e-6f};
  for (int i = 1; i < 100; ++i) ms.push_back(end * float(i) / 100.0f);
  for (int i = -20; i < 20; ++i) ms.push_back(kappa + float(i) / 4.0f);
  const float last = std::nextafter(end, 0.0f);
  std::erase_if(ms, [last](float m) { return m < 0.0f || m >= last; });
  return ms;
}

/// The derivatives of phi in the form in which a fit computes them (docs/math.md).
template <class Real>
struct Derivatives {
  Real byM, byKappa;
};
template <class Real>
Derivatives<Real> derivatives(const KernelConstants<Real>& c, Real m) {
  const Real phi = kernelPhi(c, m), quotient = phi + c.base;
  return {quotient * (quotient * c.slope - Real(1)), c.slope * quotient * (Real(1) - phi)};
}

class KernelOfKappa : public testing::TestWithParam<float> {
 protected:
  template <class Real>
  [[nodiscard]] KernelConstants<Real> constants() const {
    return kernelConstants<Real>(kernelOf(GetParam()));
  }
  template <class Real>
  void expectIsTheDefinition() const;
  template <class Real>
  void expectDerivativesOfTheDefinition() const;
  template <class Real>
  void expectEndsWithoutAJump() const;
  template <class Real>
  void expectFallsFromOne() const;
};

INSTANTIATE_TEST_SUITE_P(Kappas, KernelOfKappa,
                         testing::Values(-30.0f, -5.0f, -1.0f, 0.0f, 0.5f, 2.0f, 5.0f, 12.0f, 50.0f,
                                         500.0f, 5000.0f));

template <class Real>
void KernelOfKappa::expectIsTheDefinition() const {
  const auto c = constants<Real>();
  for (const float m : samples(GetParam())) {
    const auto expected = double(definition(GetParam(), m));
    EXPECT_NEAR(double(kernelPhi(c, Real(m))), expected, kRounding<Real>) << "m = " << m;
  }
}

TEST_P(KernelOfKappa, IsTheDefinition) {
  expectIsTheDefinition<float>();
  expectIsTheDefinition<double>();
}

// Both derivatives are products of two terms, each at most 1 / (1 - eps) and off by what the plan
// bounds: twice the plan's tolerance. The derivative by kappa has the slope in front, which is less
// than B and tiny towards the Gaussian, and so has its tolerance, or any sign would pass there.
template <class Real>
void KernelOfKappa::expectDerivativesOfTheDefinition() const {
  const auto c = constants<Real>();
  const long double h = 1e-6L;
  for (const float m : samples(GetParam())) {
    const auto found = derivatives(c, Real(m));
    const auto byM =
        double((definition(GetParam(), m + h) - definition(GetParam(), m - h)) / (2 * h));
    // The differences err by h^2 / 6 times the third derivative, which is below 1, and by the
    // rounding of phi and m in long double, 1e-19 (1 + m) / h.
    const double difference = 1e-12 + 1e-13 * (1.0 + double(m));
    EXPECT_NEAR(double(found.byM), byM, 2 * kRounding<Real> + difference) << "m = " << m;
    const auto byKappa = double(definitionByKappa(GetParam(), m));
    EXPECT_NEAR(double(found.byKappa), byKappa, 2 * kRounding<Real> * double(c.plateau))
        << "m = " << m;
  }
}

TEST_P(KernelOfKappa, HasTheDefinitionsDerivatives) {
  expectDerivativesOfTheDefinition<float>();
  expectDerivativesOfTheDefinition<double>();
}

TEST_P(KernelOfKappa, MovesByItsDerivativeWhenKappaMoves) {
  const float kappa = GetParam();
  const auto c = constants<double>();
  const double h = 1e-5;
  // Both neighbours round kappa, m and phi to half an ulp; h^2 / 6 is smaller.
  const double tolerance = 1e-10 + kRounding<double> * (1.0 + std::abs(double(kappa))) / h;
  for (const float m : samples(kappa)) {
    if (double(m) >= double(c.cutoff) - 0.1) continue;  // inside the supports of both neighbours
    const auto above = kernelConstants<double>(kernelOf(kappa), kappa + h);
    const auto below = kernelConstants<double>(kernelOf(kappa), kappa - h);
    const double difference = (kernelPhi(above, double(m)) - kernelPhi(below, double(m))) / (2 * h);
    EXPECT_NEAR(derivatives(c, double(m)).byKappa, difference, tolerance) << "m = " << m;
  }
}

TEST_P(KernelOfKappa, IsHalfAtItsWidth) {
  const auto c = constants<double>();
  EXPECT_NEAR(kernelPhi(c, kernelWidth(c).m), 0.5, kRounding<double> * (1.0 + c.shift));
  const double h = 1e-5;
  const auto logMAt = [&](double kappa) {
    return std::log(kernelWidth(kernelConstants<double>(kernelOf(GetParam()), kappa)).m);
  };
  const double difference = (logMAt(GetParam() + h) - logMAt(GetParam() - h)) / (2 * h);
  // The tolerance is that of the test above.
  EXPECT_NEAR(kernelWidth(c).logMByKappa, difference,
              1e-10 + kRounding<double> * (1.0 + std::abs(double(GetParam()))) / h);
}

template <class Real>
void KernelOfKappa::expectEndsWithoutAJump() const {
  const auto c = constants<Real>();
  const auto exact = double(definitionOfCutoff(GetParam()));
  EXPECT_NEAR(double(c.cutoff), exact, exact * kRounding<Real>);
  // The slope at the end is below eps / (1 - eps), and the cutoff has a rounding error of its own.
  const double jump = kRounding<Real> * (1.0 + 0.01 * exact);
  EXPECT_NEAR(double(kernelPhi(c, std::nextafter(c.cutoff, Real(0)))), 0.0, jump);
  EXPECT_EQ(kernelPhi(c, c.cutoff), Real(0));
  EXPECT_EQ(double(supportRadius(c)), double(std::sqrt(c.cutoff)));
}

TEST_P(KernelOfKappa, IsContinuousWhereItsSupportEnds) {
  expectEndsWithoutAJump<float>();
  expectEndsWithoutAJump<double>();
}

TEST_P(KernelOfKappa, IsExactlyZeroBeyondItsSupport) {
  const auto c = constants<float>();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float m :
       {c.cutoff, c.cutoff * 1.5f, 1e30f, infinity, std::numeric_limits<float>::quiet_NaN()})
    EXPECT_EQ(kernelPhi(c, m), 0.0f) << "m = " << m;
}

template <class Real>
void KernelOfKappa::expectFallsFromOne() const {
  const auto c = constants<Real>();
  EXPECT_NEAR(double(kernelPhi(c, Real(0))), 1.0, kRounding<Real>);
  constexpr int kSteps = 10'000;
  Real previous = kernelPhi(c, Real(0));
  for (int i = 1; i <= kSteps; ++i) {
    const Real phi = kernelPhi(c, c.cutoff * Real(i) / Real(kSteps));
    // exp may err in its last place, which changes the sum and the quotient by one ulp each.
    ASSERT_LE(phi, previous + 2 * std::numeric_limits<Real>::epsilon()) << "step " << i;
    ASSERT_GE(double(phi), -kRounding<Real>) << "step " << i;
    previous = phi;
  }
}

TEST_P(KernelOfKappa, FallsFromOne) {
  expectFallsFromOne<float>();
  expectFallsFromOne<double>();
}

TEST_P(KernelOfKappa, HasTheSlopeConstantThatTurnsItIntoALogistic) {
  const auto c = constants<double>();
  for (const float m : samples(GetParam())) {
    const double quotient = kernelPhi(c, double(m)) + c.base;
    const double logistic = c.plateau / (c.plateau + std::exp(double(m) - c.shift));
    EXPECT_NEAR(quotient * c.slope, logistic, kRounding<double> * c.plateau) << "m = " << m;
  }
}

TEST(PaperKernel, IsThePapersFormulaInThePapersScales) {
  // Paper, eq. 5: sigma(k (1 - q)) / sigma(k) for q < 1.42^2, with k = 5 and m = k q.
  constexpr double k = 5.0;
  const Kernel kernel{.form = KernelForm::kPaper, .kappa = float(k)};
  const auto c = kernelConstants<double>(kernel);
  const auto sigma = [](double x) { return 1.0 / (1.0 + std::exp(-x)); };
  const double qEnd = double(Kernel::kPaperCutoff) * double(Kernel::kPaperCutoff);
  for (int i = 0; i < 1000; ++i) {
    const double q = qEnd * i / 1000.0;
    EXPECT_NEAR(kernelPhi(c, k * q), sigma(k * (1.0 - q)) / sigma(k), kRounding<double>);
  }
  EXPECT_EQ(kernelPhi(c, k * qEnd * (1.0 + 1e-14)), 0.0);
  EXPECT_NEAR(supportRadius(c) / std::sqrt(k), 1.42, 1e-7);  // kPaperCutoff is a float
}

TEST(PaperKernel, EndsAtTheSameValueForEveryK) {
  const auto end = kernelConstants<double>({.form = KernelForm::kPaper, .kappa = Kernel::kPaperK});
  const double value = kernelPhi(end, std::nextafter(end.cutoff, 0.0));
  for (const float k : {-30.0f, 0.5f, 3.0f, 50.0f}) {
    const auto c = kernelConstants<double>({.form = KernelForm::kPaper, .kappa = k});
    EXPECT_NEAR(kernelPhi(c, std::nextafter(c.cutoff, 0.0)), value, 1e-12) << k;
    EXPECT_EQ(kernelPhi(c, std::nextafter(c.cutoff, 1e9)), 0.0) << k;
  }
}

TEST(PaperKernel, JumpsWhereItsSupportEnds) {
  const Kernel kernel{.form = KernelForm::kPaper, .kappa = 5.0f};
  const auto c = kernelConstants<double>(kernel);
  // The value is 1 / ((1 + e^(k (1.42^2 - 1))) sigma(k)), the 0.6 % that the continuous form
  // subtracts.
  EXPECT_NEAR(kernelPhi(c, std::nextafter(c.cutoff, 0.0)), 0.0062, 5e-5);
}

TEST(GaussianLimit, IsTheShiftedGaussian) {
  const auto eps = double(Kernel::kDefaultEpsilon);
  for (const float kappa : {-30.0f, -50.0f, -1e4f}) {
    const auto c = kernelConstants<double>(kernelOf(kappa));
    EXPECT_NEAR(c.cutoff, -std::log(eps), std::exp(double(kappa)) + kRounding<double>);
    for (double m = 0.0; m < 5.0; m += 0.01)
      // (1 + E) / (E + e^m) differs from e^-m by at most E.
      EXPECT_NEAR(kernelPhi(c, m), (std::exp(-m) - eps) / (1.0 - eps),
                  2.0 * std::exp(double(kappa)) + kRounding<double>);
  }
}

class ExtremeKappa : public testing::TestWithParam<float> {
 protected:
  template <class Real>
  static void expectFiniteAndBounded(float kappa) {
    const auto c = kernelConstants<Real>(kernelOf(kappa));
    for (const Real x : {c.shift, c.numerator, c.plateau, c.base, c.slope, c.cutoff})
      ASSERT_TRUE(std::isfinite(x));
    for (int i = 0; i <= 1000; ++i) {
      const Real m = c.cutoff * Real(i) / Real(1000);
      const auto d = derivatives(c, m);
      ASSERT_TRUE(std::isfinite(d.byM) && std::isfinite(d.byKappa)) << "step " << i;
      ASSERT_NEAR(double(kernelPhi(c, m)), 0.5, 0.5 + kRounding<Real>) << "step " << i;
    }
  }
};

TEST_P(ExtremeKappa, LeavesEverythingFinite) {
  expectFiniteAndBounded<float>(GetParam());
  expectFiniteAndBounded<double>(GetParam());
}

INSTANTIATE_TEST_SUITE_P(Kappas, ExtremeKappa,
                         testing::Values(-1e4f, -100.0f, -88.0f, 0.0f, 88.0f, 89.0f, 1e4f));

// ---- Ellipsoids

/// n unit spheres of intensity 1 at the origin.
Ellipsoids unitSpheres(std::size_t n, bool perEllipsoidKappa = false) {
  Ellipsoids e;
  e.resize(n, perEllipsoidKappa);
  e.intensity.assign(n, 1.0f);
  e.rotation[0].assign(n, 1.0f);
  return e;
}

/// Every array of e; the tests spoil one at a time.
std::vector<std::vector<float>*> arraysOf(Ellipsoids& e) {
  std::vector<std::vector<float>*> arrays{&e.intensity};
  for (auto& v : e.center) arrays.push_back(&v);
  for (auto& v : e.logScale) arrays.push_back(&v);
  for (auto& v : e.rotation) arrays.push_back(&v);
  if (!e.kappa.empty()) arrays.push_back(&e.kappa);
  return arrays;
}

TEST(Ellipsoids, AnyArrayOfAnotherLengthIsFound) {
  auto good = unitSpheres(2, true);
  checkInvariants(good);
  const std::size_t arrays = arraysOf(good).size();
  ASSERT_EQ(arrays, 12u);
  for (std::size_t i = 0; i < arrays; ++i) {
    auto bad = unitSpheres(2, true);
    arraysOf(bad)[i]->push_back(1.0f);
    EXPECT_THROW(checkInvariants(bad), std::logic_error) << "array " << i;
  }
}

class NonFiniteEllipsoid : public testing::TestWithParam<float> {};

TEST_P(NonFiniteEllipsoid, IsFoundInAnyParameter) {
  auto good = unitSpheres(2, true);
  ASSERT_TRUE(wellFormed(good));
  for (std::size_t i = 0; i < arraysOf(good).size(); ++i) {
    auto bad = good;
    arraysOf(bad)[i]->back() = GetParam();
    EXPECT_FALSE(wellFormed(bad)) << "array " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Values, NonFiniteEllipsoid,
                         testing::Values(std::numeric_limits<float>::quiet_NaN(),
                                         std::numeric_limits<float>::infinity(),
                                         -std::numeric_limits<float>::infinity()));

TEST(WellFormed, ToleratesRoundingOfAQuaternionButNoMore) {
  // The rounding of four components to float32 changes the length by at most 2 ulp of 1, which are
  // 1.2e-7 each.
  auto e = unitSpheres(1);
  const float half = 0.5f * (1.0f + 4 * std::numeric_limits<float>::epsilon());
  for (auto& q : e.rotation) q[0] = half;
  EXPECT_TRUE(wellFormed(e));
  e.rotation[1][0] = 0.5001f;  // changes the length by 5e-5; the stated bound is 1e-5
  EXPECT_FALSE(wellFormed(e));
  for (auto& q : e.rotation) q[0] = 0.0f;
  EXPECT_FALSE(wellFormed(e));
}

}  // namespace

}  // namespace esvr
