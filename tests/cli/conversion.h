#pragma once
/// Runs the converters and the comparison as a user does: conversions there and back in a folder of the test, with what
/// most tests of the converters include.

#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "cli/run_program.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "vdb/foreign_grids.h"

namespace esvr::test {

inline ProgramRun vdb2esvr(const Words& arguments) { return runProgram(VDB2ESVR, arguments); }
inline ProgramRun esvr2vdb(const Words& arguments) { return runProgram(ESVR2VDB, arguments); }

/// A fit that takes milliseconds.
inline ProgramRun quickFit(const std::string& input, const std::string& output,
                           const Words& more = {}) {
  return vdb2esvr(joined(
      {input, output, "--count", "30", "--iterations", "60", "--representation", "ellipsoids"},
      more));
}

/// Runs a command of the program: "check" or "table".
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

/// A folder for a source `in.vdb`, its conversion `out.esvr`, and what comes back of it, `back.vdb`.
class Conversion : public FolderTest {
 protected:
  [[nodiscard]] std::string in() const { return at("in.vdb"); }
  [[nodiscard]] std::string out() const { return at("out.esvr"); }
  [[nodiscard]] std::string back() const { return at("back.vdb"); }
  [[nodiscard]] bool outIsThere() const { return std::filesystem::exists(out()); }

  [[nodiscard]] ProgramRun convert(const Words& more = {}) const {
    return vdb2esvr(joined({in(), out(), "--force"}, more));
  }
  [[nodiscard]] ProgramRun fitQuickly(const Words& more = {}) const {
    return quickFit(in(), out(), more);
  }
  ProgramRun convertBack(const Words& more = {}) const {
    return succeeded(esvr2vdb(joined({out(), back(), "--force"}, more)));
  }
  /// \return the run of vdb2esvr
  ProgramRun thereAndBack(const Words& more = {}) const {
    auto run = succeeded(convert(more));
    convertBack();
    return run;
  }
  [[nodiscard]] ProgramRun check(const std::string& candidate, const Words& more = {}) const {
    return compare("check", joined({in(), candidate}, more));
  }
};

/// The folder of a conversion with a valid source.
class Vdb2Esvr : public Conversion {
 protected:
  void SetUp() override { writeInput(in(), {{.voxels = softBall({})}}); }
};

/// Runs a command line in a shell that limits files to 512 bytes, which has the effect of a full
/// disk. A message on stderr still fits.
inline ProgramRun runOnFullDisk(const std::string& commandLine) {
  return runShell("ulimit -f 1; exec " + commandLine);
}

}  // namespace esvr::test
