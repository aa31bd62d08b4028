#pragma once
/// Runs the two converters as a user does.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "cli/run_program.h"
#include "cli/vdb_inputs.h"

namespace esvr::test {

inline ProgramRun vdb2esvr(const std::vector<std::string>& arguments) {
  return runProgram(VDB2ESVR, arguments);
}
inline ProgramRun esvr2vdb(const std::vector<std::string>& arguments) {
  return runProgram(ESVR2VDB, arguments);
}

/// A fit that takes milliseconds.
inline ProgramRun quickFit(const std::string& input, const std::string& output,
                           std::vector<std::string> more = {}) {
  more.insert(more.begin(), {input, output, "--count", "30", "--iterations", "60",
                             "--representation", "ellipsoids"});
  return vdb2esvr(more);
}

/// Runs a command line in a shell that limits files to 512 bytes, which has the effect of a full
/// disk. A message on stderr still fits.
inline ProgramRun runOnFullDisk(const std::string& commandLine) {
  return runProgram("/bin/sh", {"-c", "ulimit -f 1; exec " + commandLine});
}

/// A folder with one valid input file.
class Vdb2Esvr : public testing::Test {
 protected:
  void SetUp() override { writeInput(in(), {{.voxels = softBall({})}}); }
  [[nodiscard]] std::string in() const { return folder_ / "in.vdb"; }
  [[nodiscard]] std::string out() const { return folder_ / "out.esvr"; }
  [[nodiscard]] ProgramRun fitQuickly(const std::vector<std::string>& more = {}) const {
    return quickFit(in(), out(), more);
  }
  [[nodiscard]] bool outIsThere() const { return std::filesystem::exists(out()); }

  TemporaryFolder folder_;
};

}  // namespace esvr::test
