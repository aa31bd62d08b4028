// Plan: the weights of a sum are found from exact samples and from noisy ones. The first weights
// hold before anything was learned and where the samples do not tell. What was learned long ago
// counts less.

#include "codec/least_squares.h"

#include <gtest/gtest.h>

#include "../field/random_field.h"

namespace esvr::codec {
namespace {

using Squares = LeastSquares<3>;

/// Learns samples of 2 a - b + 0.5 c.
void learnSamples(Squares& squares, int count, double noise) {
  test::Random random(5);
  for (int n = 0; n < count; ++n) {
    const Squares::Terms terms{random(-9.0, 9.0), random(-9.0, 9.0), random(-9.0, 9.0)};
    const double target = 2.0 * terms[0] - terms[1] + 0.5 * terms[2];
    squares.learn(terms, target + noise * random(-1.0, 1.0));
  }
  squares.solve();
}

TEST(LeastSquares, BeginsWithTheFirstWeights) {
  Squares squares({0.5, 0.25, 0.0});
  EXPECT_EQ(squares.predict({4.0, 4.0, 4.0}), 3.0);
  squares.solve();
  EXPECT_DOUBLE_EQ(squares.predict({4.0, 4.0, 4.0}), 3.0);
}

/// The first weights count as 4 squared units in each term, and the samples as 27 * 1000. The error
/// is at most 4 / 27000 of the distances from the first weights, which sum to 3.5, times 2.
TEST(LeastSquares, FindsTheWeightsOfExactSamples) {
  Squares squares({});
  learnSamples(squares, 1000, 0.0);
  EXPECT_NEAR(squares.predict({2.0, 2.0, 2.0}), 3.0, 2e-3);
}

/// The standard error of a weight is 0.58 / sqrt(27000) = 0.0035; that of the sum is 0.012.
TEST(LeastSquares, FindsTheWeightsOfNoisySamples) {
  Squares squares({});
  learnSamples(squares, 1000, 1.0);
  EXPECT_NEAR(squares.predict({2.0, 2.0, 2.0}), 3.0, 0.05);
}

TEST(LeastSquares, KeepsTheFirstWeightsOfTermsThatAreNeverThere) {
  Squares squares({0.0, 0.0, 0.75});
  for (int n = 0; n < 100; ++n) squares.learn({1.0, 1.0, 0.0}, 1.0);
  squares.solve();
  EXPECT_NEAR(squares.predict({0.0, 0.0, 4.0}), 3.0, 1e-12);
}

TEST(LeastSquares, FollowsTheLatestSamples) {
  Squares squares({});
  for (int n = 0; n < 1000; ++n) squares.learn({1.0, 0.0, 0.0}, 1.0);
  for (int n = 0; n < 500; ++n) squares.fade();  // 1000 * 0.98^500 = 0.04 samples are left
  for (int n = 0; n < 1000; ++n) squares.learn({1.0, 0.0, 0.0}, -1.0);
  squares.solve();
  EXPECT_NEAR(squares.predict({1.0, 0.0, 0.0}), -1.0, 1e-3);
}

TEST(LeastSquares, KeepsItsWeightsIfSumsOverflow) {
  Squares squares({1.0, 0.0, 0.0});
  squares.learn({1e200, 1e200, 0.0}, 1e200);
  squares.solve();
  EXPECT_EQ(squares.predict({2.0, 0.0, 0.0}), 2.0);
}

}  // namespace
}  // namespace esvr::codec
