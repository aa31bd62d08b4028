#pragma once
/// Catches all errors of a program.

#include <functional>
#include <string>

namespace esvr::cli {

/// Runs a program's body. If it throws, prints "NAME: text" to stderr and returns the exit code:
/// Error::exitCode(), 5 if memory ran out, and 1 for any other error or if stdout is not writable.
/// \param body  returns the exit code of a run that does not throw
int runMain(const std::string& program, const std::function<int()>& body);

}  // namespace esvr::cli
