#pragma once
/// The one place of a program where errors are caught.

#include <functional>
#include <string>

namespace esvr::cli {

/// Runs a program's body, prints what it throws to stderr ("NAME: text") and turns it into the
/// exit code: Error::exitCode(); 5 where memory ran out; 1 for anything else, and where stdout
/// could not be written.
/// \param body  returns the exit code of a run that did not throw
int runMain(const std::string& program, const std::function<int()>& body);

}  // namespace esvr::cli
