#pragma once
/// The folder of a test of vdb2esvr.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "cli/converters.h"
#include "cli/vdb_inputs.h"

namespace esvr::test {

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
