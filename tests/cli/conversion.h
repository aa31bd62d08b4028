#pragma once
/// Runs the converters and the comparison as a user does: conversions there and back in a folder of the test, with what
/// most tests of the converters include.

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
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

/// A folder with a grid, `in.vdb`, and a fit of it, `in.esvr`.
class FittedBall : public FolderTest {
 protected:
  void SetUp() override {
    writeInput(at("in.vdb"), {{.voxels = softBall({})}});
    succeeded(quickFit(at("in.vdb"), at("in.esvr")));
  }
};

/// Expects that three threads take frames one by one in the memory that one frame needs, to within a factor of two.
/// \param run  runs a program with these options
template <class Run>
void expectOneByOneWhereMemoryIsShort(const Run& run) {
  const auto codeWithin = [&](std::uint64_t bytes, const char* threads) {
    return run({"--max-memory", std::to_string(bytes), "--threads", threads, "--force"}).exitCode;
  };
  std::uint64_t enough = 1024;
  while (codeWithin(enough, "1") == 5) enough *= 2;
  EXPECT_EQ(codeWithin(enough, "3"), 0) << "a third of it is too little for a frame";
  EXPECT_EQ(codeWithin(enough / 2, "3"), 5);
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

}  // namespace esvr::test
