#include "compare/shell_command.h"

#include <sys/wait.h>

#include <array>
#include <cstdio>

#include "esvr/error.h"

namespace esvr::compare {
namespace {

std::string lastLine(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  const std::size_t begin = text.rfind('\n');
  return begin == std::string::npos ? text : text.substr(begin + 1);
}

[[noreturn]] void fail(const std::string& command, const std::string& option, int status,
                       const std::string& output) {
  const std::string end = WIFEXITED(status) ? "code " + std::to_string(WEXITSTATUS(status))
                                            : "signal " + std::to_string(WTERMSIG(status));
  const std::string last = lastLine(output);
  throw RuntimeFailure(option + ": " + command + " ended with " + end +
                       (last.empty() ? "" : ": " + last));
}

/// What `shell` prints. It runs `command`, which is named if it fails.
std::string printed(const std::string& shell, const std::string& command,
                    const std::string& option) {
  FILE* pipe = popen(shell.c_str(), "r");
  if (!pipe) throw RuntimeFailure(option + ": cannot run " + command);
  std::string text;
  std::array<char, 256> part{};
  while (std::fgets(part.data(), int(part.size()), pipe)) text += part.data();
  const int status = pclose(pipe);
  if (status != 0) fail(command, option, status, text);
  return text;
}

}  // namespace

std::string outputOf(const std::string& command, const std::string& option) {
  return printed(command, command, option);
}

void runCommand(const std::string& command, const std::string& option) {
  (void)printed("{ " + command + "\n} 2>&1", command, option);
}

}  // namespace esvr::compare
