#include "esvr/ellipsoids.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace esvr {
namespace {

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
