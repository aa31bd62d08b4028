// Plan: the encoder agrees with the test vectors of RFC 4648, and encodes bytes above 127.

#include "report/base64.h"

#include <gtest/gtest.h>

namespace esvr::report {
namespace {

TEST(Base64, agreesWithTheStandardsVectors) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

TEST(Base64, takesAnyByte) { EXPECT_EQ(base64(std::string("\xff\xfe\x00", 3)), "//4A"); }

}  // namespace
}  // namespace esvr::report
