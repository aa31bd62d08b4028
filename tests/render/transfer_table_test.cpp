// Plan: the light of segments of random values agrees with sums over 4000 places in float64, for
// curves with ramps, steps, plateaus of no opacity and of full opacity. In the sums each place
// absorbs the light of those behind it; the table does so in pieces with an extinction of up to
// 1/4, within which it is neglected. That moves a color by up to 1/48 of its change along the
// segment and leaves the opacity unchanged. Opacities err by less than 1e-4 (transfer_table.h), and
// by as much again where an opacity of 1 is approached within one interval of the table. At a step
// inside an interval, extinction may be off by 1/8 interval.
#include "render/transfer_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "field/random_field.h"
#include "render/reference_picture.h"

namespace esvr::test {
namespace {

constexpr int kPlaces = 4000;
constexpr double kOpacity = 2e-4, kColor = 1.0 / 48.0;
/// The light of a segment by the table of a function.
class SegmentTable {
 public:
  SegmentTable(const TransferFunction& f, double length) : table_(f, {length, true}) {}
  PixelColor operator()(float a, float b) const { return table_.view().segments(a, b); }

 private:
  TransferTable table_;
};

PixelColor summed(const TransferFunction& f, double length, double a, double b) {
  double color[3] = {}, left = 1.0;
  for (int i = 0; i < kPlaces; ++i) {
    const Channels at = channelsAt(f, a + (b - a) * (i + 0.5) / kPlaces, length);
    if (!(at[3] > 0.0)) continue;
    const double alpha = -std::expm1(-at[3] / kPlaces);
    for (std::size_t c = 0; c < 3; ++c) color[c] += left * alpha * at[c] / at[3];
    left *= 1.0 - alpha;
  }
  return {float(color[0]), float(color[1]), float(color[2]), float(1.0 - left)};
}

void expectLight(const PixelColor& actual, const PixelColor& expected, double opacity = kOpacity) {
  EXPECT_NEAR(actual.alpha, expected.alpha, opacity);
  EXPECT_NEAR(actual.r, expected.r, kColor);
  EXPECT_NEAR(actual.g, expected.g, kColor);
  EXPECT_NEAR(actual.b, expected.b, kColor);
}

TransferFunction withOpacity(OpacityCurve curve) { return {builtInColorMap("viridis"), curve}; }

void expectSums(const TransferFunction& f, double length, double opacity = kOpacity) {
  const SegmentTable table(f, length);
  Random random(7);
  for (int i = 0; i < 40; ++i) {
    const float a = float(random(-0.3, 1.3)), b = float(random(-0.3, 1.3));
    SCOPED_TRACE(std::to_string(a) + " to " + std::to_string(b));
    expectLight(table(a, b), summed(f, length, a, b), opacity);
  }
}

TEST(SegmentTable, HoldsTheIntegralsOfRampsAndPlateaus) {
  for (const double length : {0.05, 0.3, 2.0}) {
    for (const char* name : {"inverse", "tent", "smoke", "ct-bone"})
      expectSums(withOpacity(builtInOpacity(name)), length);
    expectSums(withOpacity({{0.0, 0.0}, {0.25, 0.0}, {0.5, 0.9}, {0.75, 0.0}, {1.0, 0.0}}), length);
  }
}

TEST(SegmentTable, HoldsTheIntegralsOfSteps) {
  expectSums(withOpacity({{0.0, 0.1}, {0.5, 0.1}, {0.5, 0.7}, {1.0, 0.7}}), 0.5);
  expectSums(withOpacity({{0.0, 0.0}, {0.3, 0.0}, {0.3, 0.5}, {1.0, 0.0}}), 1.0, 1e-3);
}

TEST(SegmentTable, FullOpacityIsOpaque) {
  for (const double length : {1e-3, 1.0, 50.0}) {
    const SegmentTable table(withOpacity({{0.0, 0.0}, {0.5, 0.0}, {0.5, 1.0}, {1.0, 1.0}}), length);
    EXPECT_EQ(table(0.6f, 0.9f).alpha, 1.0f);
    EXPECT_EQ(table(0.8f, 0.8f).alpha, 1.0f);
    EXPECT_EQ(table(3.0f, 1.0f).alpha, 1.0f);
    EXPECT_NEAR(table(0.26f, 0.6f).alpha, 1.0f, 1e-6f) << "more than a quarter is opaque";
    EXPECT_EQ(table(-0.4f, 0.49f).alpha, 0.0f);
  }
}

TEST(SegmentTable, FogIsPreciseBesideFullOpacity) {
  // Of 32-bit floats, the integral up to the fog would leave no digits of the fog's.
  const SegmentTable table(withOpacity({{0.0, 1.0}, {0.5, 1.0}, {0.5, 0.001}, {1.0, 0.001}}), 1.0);
  for (const float apart : {0.0f, 1e-6f, 1e-4f, 5e-4f, 1e-3f, 0.1f})
    EXPECT_NEAR(table(0.8f, 0.8f + apart).alpha, 0.001, 3e-5) << apart;
}

TEST(SegmentTable, CloseValuesHaveThePointsOwnLight) {
  const TransferFunction f = withOpacity(builtInOpacity("smoke"));
  const SegmentTable table(f, 1.0);
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const float a = float(random(0.0, 1.0)), b = a + float(random(-1e-4, 1e-4));
    expectLight(table(a, b), summed(f, 1.0, a, a), 3e-4);
    expectLight(table(a, std::nextafter(a, 2.0f)), table(a, a), 1e-5);
  }
}

TEST(SegmentTable, ValuesBeyondTheFunctionHaveItsEnds) {
  const SegmentTable table(withOpacity({{0.0, 0.25}, {1.0, 0.75}}), 1.0);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_NEAR(table(-kInfinity, -5.0f).alpha, 0.25, 1e-5);
  EXPECT_NEAR(table(2.0f, kInfinity).alpha, 0.75, 1e-5);
  EXPECT_NEAR(table(-kInfinity, kInfinity).alpha, 1.0 - std::sqrt(0.75 * 0.25), 1e-4);
}

TEST(SegmentTable, AFunctionWithoutExtentIsAStep) {
  const SegmentTable table({{ColorSpace::kRgb, {{3.0, {1, 0, 0}}}, {}}, {{3.0, 0.0}, {3.0, 0.5}}},
                           1.0);
  EXPECT_EQ(table(1.0f, 2.999f).alpha, 0.0f);
  EXPECT_NEAR(table(3.0f, 4.0f).alpha, 0.5, 1e-6);
  EXPECT_NEAR(table(2.0f, 4.0f).alpha, 1.0 - std::sqrt(0.5), 1e-5);
}

TEST(SegmentTable, NotANumberHasItsOwnColor) {
  TransferFunction f = withOpacity(builtInOpacity("linear"));
  f.colors.nan = {1, 0, 1};
  const SegmentTable table(f, 0.01);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const PixelColor& c : {table(nan, 0.5f), table(0.5f, nan)})
    EXPECT_TRUE(c.r == 1.0f && c.g == 0.0f && c.b == 1.0f && c.alpha == 1.0f);
}

}  // namespace
}  // namespace esvr::test
