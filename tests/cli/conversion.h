#pragma once
/// Conversions there and back, for the tests of the converters, with what most of these include.

#include <filesystem>
#include <string>

#include "cli/compare_fixture.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"

namespace esvr::test {

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
