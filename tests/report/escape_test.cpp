// Plan: the tests check markup, control characters, and valid and invalid UTF-8.

#include "report/escape.h"

#include <gtest/gtest.h>

namespace esvr::report {
namespace {

TEST(Escaped, makesMarkupText) {
  EXPECT_EQ(escaped("<a b=\"c\">&"), "&lt;a b=&quot;c&quot;&gt;&amp;");
}

TEST(Escaped, keepsLinesAndDropsOtherControls) {
  EXPECT_EQ(escaped("a\nb\x1b[1m\x7f"), "a\nb?[1m?");
}

TEST(Escaped, keepsUtf8) {
  EXPECT_EQ(escaped("\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80"),
            "\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80");
}

TEST(Escaped, replacesWhatIsNoUtf8) {
  EXPECT_EQ(escaped("\xff"), "?");
  EXPECT_EQ(escaped("a\xc3"), "a?") << "cut short";
  EXPECT_EQ(escaped("\xc0\xbc"), "??") << "an overlong '<'";
  EXPECT_EQ(escaped("\xe0\x80\xbc"), "???");
  EXPECT_EQ(escaped("\xed\xa0\x80"), "???") << "a surrogate";
  EXPECT_EQ(escaped("\xf4\x90\x80\x80"), "????") << "beyond Unicode";
}

}  // namespace
}  // namespace esvr::report
