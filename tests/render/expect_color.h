#pragma once

#include <gtest/gtest.h>

#include "esvr/transfer_function.h"

namespace esvr::test {

inline void expectColor(const Rgb& actual, const Rgb& expected, double tolerance) {
  EXPECT_NEAR(actual.r, expected.r, tolerance);
  EXPECT_NEAR(actual.g, expected.g, tolerance);
  EXPECT_NEAR(actual.b, expected.b, tolerance);
}

/// The color of three bytes.
inline Rgb bytes(int r, int g, int b) { return {r / 255.0, g / 255.0, b / 255.0}; }

}  // namespace esvr::test
