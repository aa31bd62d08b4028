// Plan: the messages of the dynamic linker (LD_DEBUG=files, ld.so(8)) name every library that a
// command loads or looks for. Commands that need no device must not look for CUDA's driver; a
// conversion on a GPU must, which shows that the messages are complete.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/vdb_inputs.h"
#include "esvr/device.h"

namespace esvr {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* kDriver = "libcuda.so";

class Start : public test::FolderTest {
 protected:
  void SetUp() override {
    test::writeInput(at("in.vdb"), {{.voxels = test::softBall({})}});
    ASSERT_EQ(test::quickFit(at("in.vdb"), at("in.esvr")).exitCode, 0);
  }

  /// What the dynamic linker says about a run.
  static std::string librariesOf(const char* program, const std::vector<std::string>& arguments) {
    ::setenv("LD_DEBUG", "files", 1);
    const auto run = test::runProgram(program, arguments);
    ::unsetenv("LD_DEBUG");
    EXPECT_THAT(run.err, HasSubstr("libstdc++")) << "the linker says nothing";
    return run.err;
  }
};

TEST_F(Start, doesNotLookForADriverWithoutADevice) {
  for (const char* job : {"--list", "--check"})
    EXPECT_THAT(librariesOf(ESVR2VDB, {job, at("in.esvr")}), Not(HasSubstr(kDriver))) << job;
  EXPECT_THAT(librariesOf(ESVR2VDB, {"--list", at("in.vdb")}), Not(HasSubstr(kDriver)));
  EXPECT_THAT(librariesOf(ESVR2VDB, {at("in.esvr"), at("back.vdb")}), Not(HasSubstr(kDriver)));
  EXPECT_THAT(librariesOf(VDB2ESVR, {at("in.vdb"), at("o.esvr"), "--lossless", "--device", "cpu"}),
              Not(HasSubstr(kDriver)));
}

TEST_F(Start, doesNotLookForADriverForHelp) {
  for (const char* program : {VDB2ESVR, ESVR2VDB, ESVR_RENDER, ESVR_VIEW, ESVR_COMPARE})
    EXPECT_THAT(librariesOf(program, {"--help"}), Not(HasSubstr(kDriver))) << program;
}

TEST_F(Start, looksForADriverOnlyIfTheBuildHasCuda) {
  const auto libraries =
      librariesOf(VDB2ESVR, {at("in.vdb"), at("o.esvr"), "--lossless", "--device", "cuda"});
  EXPECT_EQ(libraries.find(kDriver) != std::string::npos, builtWithCuda());
}

}  // namespace
}  // namespace esvr
