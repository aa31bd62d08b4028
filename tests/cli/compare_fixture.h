#pragma once
/// Tests of esvr-compare.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/vdb_inputs.h"

namespace esvr::test {

/// Runs a command of the program: "check", "table" or "curves".
inline ProgramRun compare(const std::string& command, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), command);
  return runProgram(ESVR_COMPARE, arguments);
}

/// A folder with a grid, `ref.vdb`, and a fit of it, `fit.esvr`.
class FittedBall : public FolderTest {
 protected:
  void SetUp() override {
    writeInput(at("ref.vdb"), {{.voxels = softBall({})}});
    ASSERT_EQ(quickFit(at("ref.vdb"), at("fit.esvr")).exitCode, 0);
  }
};

}  // namespace esvr::test
