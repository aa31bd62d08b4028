#pragma once
/// Runs the two converters as a user does.

#include <string>
#include <vector>

#include "cli/run_program.h"

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

}  // namespace esvr::test
