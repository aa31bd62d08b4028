#pragma once
/// The two converters as a user runs them.

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

/// A fit of milliseconds.
inline ProgramRun quickFit(const std::string& input, const std::string& output,
                           std::vector<std::string> more = {}) {
  more.insert(more.begin(), {input, output, "--count", "30", "--iterations", "60", "--kappa", "0"});
  return vdb2esvr(more);
}

/// A shell's command line with a bound of 512 bytes on the size of files, which a full disk is
/// like; a message on stderr finds room.
inline ProgramRun runOnFullDisk(const std::string& commandLine) {
  return runProgram("/bin/sh", {"-c", "ulimit -f 1; exec " + commandLine});
}

}  // namespace esvr::test
