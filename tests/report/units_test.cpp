// Plan: the tests check rounding to three digits, the change from one unit to the next, and that no
// number has an exponent.

#include "report/units.h"

#include <gtest/gtest.h>

namespace esvr::report {
namespace {

TEST(PlainText, hasThreeDigitsAndNoExponent) {
  EXPECT_EQ(plainText(0.000012345), "0.0000123");
  EXPECT_EQ(plainText(258432.0), "258000");
  EXPECT_EQ(plainText(0.1), "0.1");
  EXPECT_EQ(plainText(0.0), "0");
  EXPECT_EQ(plainText(-2.5), "-2.5");
}

TEST(BytesText, takesTheUnitThatFits) {
  EXPECT_EQ(bytesText(800), "800 B");
  EXPECT_EQ(bytesText(45059), "45.1 KB");
  EXPECT_EQ(bytesText(999'499), "999 KB");
  EXPECT_EQ(bytesText(999'500), "1 MB") << "is rounded to the next unit";
  EXPECT_EQ(bytesText(2.6e9), "2.6 GB");
  EXPECT_EQ(bytesText(5e15), "5000 TB") << "the last unit";
}

}  // namespace
}  // namespace esvr::report
