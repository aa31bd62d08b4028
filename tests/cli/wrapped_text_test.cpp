// Plan: lines are broken between words, at the last place that keeps to the width. What has columns
// is kept, and so are empty lines. A word that is too long stands alone.
#include "cli/wrapped_text.h"

#include <gtest/gtest.h>

namespace esvr::cli {
namespace {

TEST(WrappedText, BreaksLinesAtTheLastPossibleSpace) {
  EXPECT_EQ(wrapped("one two three", 7), "one two\nthree");
  EXPECT_EQ(wrapped("one two three", 6), "one\ntwo\nthree");
  EXPECT_EQ(wrapped("one two three", 13), "one two three");
}

TEST(WrappedText, LeavesALongWordWhole) {
  EXPECT_EQ(wrapped("a incomprehensible b", 5), "a\nincomprehensible\nb");
}

TEST(WrappedText, KeepsColumnsAndEmptyLines) {
  EXPECT_EQ(wrapped("one two\n\n  a    long table\nthree four", 5),
            "one\ntwo\n\n  a    long table\nthree\nfour");
}

TEST(WrappedText, MayBeEmpty) { EXPECT_EQ(wrapped("", 80), ""); }

}  // namespace
}  // namespace esvr::cli
