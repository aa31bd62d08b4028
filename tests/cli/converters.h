#pragma once
/// Runs the two converters as a user does.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "cli/run_program.h"
#include "cli/vdb_inputs.h"

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

}  // namespace esvr::test
