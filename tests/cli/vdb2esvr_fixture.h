#pragma once
/// The folder of a test of vdb2esvr.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "cli/converters.h"
#include "cli/vdb_inputs.h"

namespace esvr::test {

/// A folder with one valid input file.
class Vdb2Esvr : public testing::Test {
 protected:
  void SetUp() override { writeInput(in(), {{.voxels = softBall({})}}); }
  [[nodiscard]] std::string in() const { return folder_ / "in.vdb"; }
  [[nodiscard]] std::string out() const { return folder_ / "out.esvr"; }
  [[nodiscard]] bool outIsThere() const { return std::filesystem::exists(out()); }

  TemporaryFolder folder_;
};

}  // namespace esvr::test
