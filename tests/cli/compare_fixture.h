#pragma once
/// Tests of esvr-compare.

#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "cli/converters.h"
#include "cli/run_program.h"
#include "cli/vdb_inputs.h"

namespace esvr::test {

/// Runs a command of the program: "check", "table" or "curves".
inline ProgramRun compare(const std::string& command, const Words& arguments) {
  return runProgram(ESVR_COMPARE, joined({command}, arguments));
}

/// A folder with a grid, `ref.vdb`, and a fit of it, `fit.esvr`.
class FittedBall : public FolderTest {
 protected:
  void SetUp() override {
    writeInput(at("ref.vdb"), {{.voxels = softBall({})}});
    succeeded(quickFit(at("ref.vdb"), at("fit.esvr")));
  }
};

/// The fields of each line. Quoted fields have neither quotes nor line feeds in these tests.
inline std::vector<Words> csvFields(const std::string& csv) {
  std::vector<Words> lines;
  std::istringstream stream(csv);
  for (std::string line; std::getline(stream, line);) {
    auto& fields = lines.emplace_back(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      if (c == ',' && !quoted)
        fields.emplace_back();
      else if (c != '"')
        fields.back() += c;
    }
  }
  return lines;
}

}  // namespace esvr::test
