// Plan: each form of a pattern gives the documented name for positive, negative, zero and long
// numbers. The frames on the disk are those whose names the pattern gives, and no others.

#include "cli/frame_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/folder_test.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::string pathOf(const std::string& pattern, FrameNumber frame) {
  return FramePattern::in(pattern)->at(frame).string();
}

struct Name {
  const char* pattern;
  FrameNumber frame;
  const char* path;
};
std::ostream& operator<<(std::ostream& out, const Name& name) { return out << name.pattern; }

class FrameName : public testing::TestWithParam<Name> {};

TEST_P(FrameName, HasTheDigitsOfThePattern) {
  EXPECT_EQ(pathOf(GetParam().pattern, GetParam().frame), GetParam().path);
}

INSTANTIATE_TEST_SUITE_P(
    Forms, FrameName,
    testing::Values(Name{"a.#.vdb", 7, "a.0007.vdb"}, Name{"a.##.vdb", 7, "a.07.vdb"},
                    Name{"a.####.vdb", 7, "a.0007.vdb"}, Name{"a.@.vdb", 7, "a.7.vdb"},
                    Name{"a.@@@.vdb", 7, "a.007.vdb"}, Name{"a.%04d.vdb", 7, "a.0007.vdb"},
                    Name{"a.%01d.vdb", 7, "a.7.vdb"}, Name{"a.%d.vdb", 7, "a.7.vdb"},
                    Name{"a.$F4.vdb", 7, "a.0007.vdb"}, Name{"a.$F.vdb", 7, "a.7.vdb"},
                    Name{"a.############.vdb", 7, "a.000000000007.vdb"},
                    Name{"a.%012d.vdb", 123456789012, "a.123456789012.vdb"}));
INSTANTIATE_TEST_SUITE_P(Numbers, FrameName,
                         testing::Values(Name{"a####", 0, "a0000"}, Name{"a####", -5, "a-005"},
                                         Name{"a@", -5, "a-5"}, Name{"a####", 12345, "a12345"},
                                         Name{"a####", -12345, "a-12345"}));
INSTANTIATE_TEST_SUITE_P(
    Places, FrameName,
    testing::Values(Name{"####", 7, "0007"}, Name{"b/####/a.vdb", 7, "b/0007/a.vdb"},
                    Name{"take#2/me@home/a.##.vdb", 7, "take#2/me@home/a.07.vdb"},
                    Name{"a.####", 7, "a.0007"}));

TEST(FramePattern, IsNoneInOtherNames) {
  for (const char* name : {"smoke.vdb", "smoke.0007.vdb", "100%.vdb", "$G4.vdb", "F4.vdb", ""})
    EXPECT_FALSE(FramePattern::in(name)) << name;
}

TEST(FramePattern, HasAReasonableNumberOfDigits) {
  EXPECT_EQ(pathOf("%032d", 1).size(), 32u);
  for (const char* name : {"%033d", "%099999999999999999999d", "$F33"})
    EXPECT_THROW((void)FramePattern::in(name), UsageError) << name;
}

class FramesOnDisk : public test::FolderTest {
 protected:
  [[nodiscard]] FramePattern pattern(const std::string& name) const {
    return *FramePattern::in(at(name));
  }
  void write(const std::string& name) const { test::writeText(at(name), ""); }
};

TEST_F(FramesOnDisk, AreInOrderOfTheirNumbers) {
  for (const char* name : {"a.0010.vdb", "a.0002.vdb", "a.-001.vdb", "a.12345.vdb", "a.0000.vdb"})
    write(name);
  EXPECT_THAT(pattern("a.####.vdb").onDisk(), ElementsAre(-1, 0, 2, 10, 12345));
}

TEST_F(FramesOnDisk, HaveNamesThatThePatternGives) {
  for (const char* name : {"a.1.vdb", "a.0001.vdb", "a.00002.vdb", "a.-0003.vdb", "a.0004.vdb.bak",
                           "aa.0005.vdb", "a.0x06.vdb", "a..vdb", "a.+007.vdb", "a.-000.vdb",
                           "a.99999999999999999999.vdb", "a.-9223372036854775808.vdb"})
    write(name);
  EXPECT_THAT(pattern("a.####.vdb").onDisk(), ElementsAre(1));
  EXPECT_THAT(pattern("a.@.vdb").onDisk(), ElementsAre(1));
  EXPECT_THAT(pattern("a.@@@@@.vdb").onDisk(), ElementsAre(-3, 2));
  EXPECT_THAT(pattern("b.#.vdb").onDisk(), IsEmpty());
  EXPECT_THAT(pattern("no/folder/a.#.vdb").onDisk(), IsEmpty());
}

TEST_F(FramesOnDisk, MayBeInFoldersOfTheirOwn) {
  std::filesystem::create_directories(at("f01"));
  std::filesystem::create_directories(at("f02"));
  write("f02/a.vdb");
  EXPECT_THAT(pattern("f##/a.vdb").onDisk(), ElementsAre(2)) << "f01 has no file";
  EXPECT_EQ(pattern("f##/a.vdb").at(2), at("f02/a.vdb"));
}

TEST_F(FramesOnDisk, WithOtherDigitsAreFound) {
  EXPECT_FALSE(pattern("a.#.vdb").withOtherDigits());
  write("a.0001.vdb");
  EXPECT_FALSE(pattern("a.#.vdb").withOtherDigits());
  EXPECT_EQ(pattern("a.@@.vdb").withOtherDigits(), at("a.0001.vdb"));
}

}  // namespace
}  // namespace esvr::cli
