// Plan: bounds may be given in value units and as a share of the range; other texts are refused.

#include "cli/error_bound.h"

#include <gtest/gtest.h>

#include "esvr/error.h"

namespace esvr::cli {
namespace {

TEST(ErrorBound, isInUnitsOrAShareOfTheRange) {
  EXPECT_EQ(parseErrorBound("max-error", "0.25").absolute(8.0), 0.25);
  EXPECT_EQ(parseErrorBound("max-error", "25%").absolute(8.0), 2.0);
}

TEST(ErrorBound, isAFiniteNumberAboveZero) {
  for (const char* text : {"", "%", "0", "-1", "much", "1x", "1%%", "inf", "nan"})
    EXPECT_THROW((void)parseErrorBound("max-error", text), UsageError) << text;
}

}  // namespace
}  // namespace esvr::cli
