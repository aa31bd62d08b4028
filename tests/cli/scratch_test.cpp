// Plan: the programs are run with so little memory that the voxels are in files. The tests check
// that the results are the same, and that a folder which cannot hold the files is refused by name.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "cli/vdb2esvr_fixture.h"

namespace esvr {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Enough for a small volume without its voxels.
constexpr const char* kLittle = "40KB";

class Scratch : public test::Vdb2Esvr {
 protected:
  using Arguments = std::vector<std::string>;

  [[nodiscard]] Arguments withLittle(Arguments more, const std::string& scratch) const {
    more.insert(more.end(), {"--max-memory", kLittle, "--scratch", scratch});
    return more;
  }
  [[nodiscard]] test::ProgramRun fitWithLittle(const std::string& output,
                                               const std::string& scratch,
                                               const Arguments& more = {}) const {
    return test::quickFit(in(), output, withLittle(more, scratch));
  }
  [[nodiscard]] std::string here() const { return folder_.path().string(); }
};

TEST_F(Scratch, HoldsVoxelsAndChangesNoBit) {
  for (const Arguments& form : {Arguments{}, {"--storage", "float32"}}) {
    const std::string little = folder_ / "little.esvr";
    ASSERT_EQ(test::quickFit(in(), out(), form).exitCode, 0);
    const auto run = fitWithLittle(little, here(), form);
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(test::readText(little), test::readText(out()));
    std::filesystem::remove(little);
    std::filesystem::remove(out());
  }
}

TEST_F(Scratch, HoldsVoxelsOfLosslessFilesOnTheWayThereAndBack) {
  const Arguments there{in(), out(), "--lossless"}, back{out(), folder_ / "back.vdb"},
      check{"check", in(), folder_ / "back.vdb", "--max-error", "0", "--fail-on", "all"};
  const auto converted = test::vdb2esvr(withLittle(there, here()));
  ASSERT_EQ(converted.exitCode, 0) << converted.err;
  const auto restored = test::esvr2vdb(withLittle(back, here()));
  ASSERT_EQ(restored.exitCode, 0) << restored.err;
  const auto checked = test::runProgram(ESVR_COMPARE, withLittle(check, here()));
  EXPECT_EQ(checked.exitCode, 0) << checked.out << checked.err;
}

// No file can be made in /proc, for root either.
TEST_F(Scratch, WithoutRoomIsAnErrorThatNamesTheFolder) {
  const auto run = fitWithLittle(out(), "/proc");
  EXPECT_EQ(run.exitCode, 5);
  EXPECT_THAT(run.err, HasSubstr("of files in /proc, which has 0 MB free"));
  EXPECT_FALSE(outIsThere());
}

TEST_F(Scratch, IsAFolderThatExistsInEveryProgram) {
  const std::string missing = folder_ / "missing";
  ASSERT_EQ(fitQuickly().exitCode, 0);
  const std::vector<std::pair<const char*, Arguments>> runs{
      {VDB2ESVR, {in(), folder_ / "a.esvr"}},
      {ESVR2VDB, {out(), folder_ / "a.vdb"}},
      {ESVR_RENDER, {out(), folder_ / "a.png"}},
      {ESVR_COMPARE, {"check", in(), out()}},
      {ESVR_COMPARE, {"table", in(), out()}},
      {ESVR_COMPARE, {"curves", in(), out(), "-o", folder_ / "c"}}};
  for (auto [program, arguments] : runs) {
    arguments.insert(arguments.end(), {"--scratch", missing});
    const auto run = test::runProgram(program, arguments);
    EXPECT_EQ(run.exitCode, 2) << program << run.out;
    EXPECT_THAT(run.err, AllOf(HasSubstr("--scratch"), HasSubstr(missing))) << program;
  }
}

}  // namespace
}  // namespace esvr
