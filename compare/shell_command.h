#pragma once
/// Runs commands of the user in a shell.

#include <string>

namespace esvr::compare {

/// What a command printed on its standard output.
/// \param option  option that has the command, for the message of an error
/// \throws RuntimeFailure  its exit code is not 0; the text has the last line that was read
[[nodiscard]] std::string outputOf(const std::string& command, const std::string& option);

/// The same for a command whose output and messages matter only if it fails.
void runCommand(const std::string& command, const std::string& option);

}  // namespace esvr::compare
