/// Plan: the tests check unique names in lists with shared, empty and number-like names. Each
/// unique name finds its own grid, and so do the other forms that the header allows.

#include "esvr/grid_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/error.h"

namespace esvr {
namespace {

using Names = std::vector<std::string>;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(GridNames, AreNumberedOnlyWhereShared) {
  EXPECT_THAT(uniqueNames(Names{"a", "b", "a", ""}), ElementsAre("a[0]", "b", "a[1]", ""));
  EXPECT_THAT(uniqueNames(Names{"", ""}), ElementsAre("[0]", "[1]"));
  EXPECT_TRUE(uniqueNames(Names{}).empty());
}

TEST(GridNames, FindTheirOwnGrid) {
  const Names names{"a", "b", "a", "", "c[7]"};
  const auto unique = uniqueNames(names);
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(findGrid(names, unique[i]), i);
}

TEST(GridNames, MeanTheFirstWhereBareAndMayAlwaysBeNumberedZero) {
  const Names names{"x", "a", "a"};
  EXPECT_EQ(findGrid(names, "a"), 1u);
  EXPECT_EQ(findGrid(names, "x[0]"), 0u);
}

TEST(GridNames, AreListedForAnUnknownName) {
  const Names names{"a", "a", "b"};
  EXPECT_THAT([&] { (void)findGrid(names, "a[2]", "smoke.vdb"); },
              ThrowsMessage<BadInput>(AllOf(HasSubstr("smoke.vdb: "), HasSubstr("\"a[2]\""),
                                            HasSubstr("\"a[0]\", \"a[1]\", \"b\""))));
  EXPECT_THAT([&] { (void)findGrid(Names{}, "a"); }, ThrowsMessage<BadInput>(HasSubstr("none")));
}

TEST(ClassNames, AreThoseOfOpenVdb) {
  EXPECT_STREQ(className(GridClass::kLevelSet), "level set");
  EXPECT_STREQ(className(GridClass::kFogVolume), "fog volume");
  EXPECT_STREQ(className(GridClass::kStaggered), "staggered");
  EXPECT_STREQ(className(GridClass::kUnknown), "unknown");
}

}  // namespace
}  // namespace esvr
