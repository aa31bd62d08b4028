// Plan: evaluatePlaces (float32, lists) agrees between voxels with a float64 sum over all ellipsoids,
// and at voxels with evaluateReference; the order and number of the places does not matter; places
// outside the index space are refused.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "esvr/error.h"
#include "esvr/field.h"
#include "field/line_form.h"
#include "field/random_field.h"

namespace esvr {
namespace {

/// The definition at any place.
double valueAt(const Field& field, const Place& place) {
  double value = field.background;
  for (const Chunk& chunk : field.chunks)
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i) {
      const Ellipsoids& e = chunk.ellipsoids;
      const double d[3] = {place[0] - chunk.origin.x - e.center[0][i],
                           place[1] - chunk.origin.y - e.center[1][i],
                           place[2] - chunk.origin.z - e.center[2][i]};
      const Matrix3 L = unitFrame(e, i);
      double m = 0.0;
      for (int r = 0; r < 3; ++r)
        m += std::pow(L[3 * r] * d[0] + L[3 * r + 1] * d[1] + L[3 * r + 2] * d[2], 2.0);
      value += double(e.intensity[i]) * kernelPhi(kernelConstants<double>(field.kernel), m);
    }
  return value;
}

std::vector<Place> randomPlaces(std::size_t count) {
  test::Random random(3);
  std::vector<Place> places(count);
  for (Place& place : places)
    for (double& x : place) x = random(-4.0, 36.0);
  return places;
}

std::vector<float> evaluated(const Field& field, const std::vector<Place>& places) {
  std::vector<float> values(places.size());
  evaluatePlaces(field, places, values);
  return values;
}

// The tolerance is that of evaluateBricks (field.h).
TEST(EvaluatePlaces, AgreesWithTheFloat64SumBetweenVoxels) {
  const Field field = test::randomField({.count = 60, .extent = 32});
  const auto places = randomPlaces(3000);
  const auto values = evaluated(field, places);
  for (std::size_t p = 0; p < places.size(); ++p)
    ASSERT_NEAR(double(values[p]), valueAt(field, places[p]), 4e-6 * test::intensitySum(field));
}

TEST(EvaluatePlaces, GivesEachPlaceTheSameValueInAnyCompany) {
  const Field field = test::randomField({.count = 60, .extent = 32});
  const auto places = randomPlaces(200);
  const auto together = evaluated(field, places);
  for (std::size_t p = 0; p < places.size(); ++p)
    ASSERT_EQ(together[p], evaluated(field, {places[p]}).front());
}

TEST(EvaluatePlaces, GivesTheBackgroundFarAway) {
  Field field = test::randomField({});
  field.background = 0.75f;
  EXPECT_EQ(evaluated(field, {{1e6, -1e6, 0.0}}).front(), 0.75f);
}

TEST(EvaluatePlaces, RefusesPlacesOutsideTheIndexSpace) {
  const Field field = test::randomField({});
  for (const double x : {3e9, -3e9, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(evaluated(field, {{x, 0.0, 0.0}}), UsageError);
}

}  // namespace
}  // namespace esvr
