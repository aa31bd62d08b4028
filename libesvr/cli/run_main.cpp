#include "cli/run_main.h"

#include <csignal>
#include <iostream>

#include "cli/failure.h"
#include "cli/printable.h"
#include "core/publish_file.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

int runAndFlush(const std::function<int()>& body) {
  const int code = body();
  std::cout.flush();
  if (!std::cout) throw RuntimeFailure("cannot write to standard output");
  return code;
}

}  // namespace

int runMain(const std::string& program, const std::function<int()>& body) {
  const auto complain = [&](const std::string& text) {
    std::cerr << program << ": " << printableMessage(text) << '\n';
  };
  keepStandardDescriptors();
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on file sizes then gives an error, not a signal
  try {
    return runAndFlush(body);
  } catch (const Cancelled& error) {
    complain("interrupted; nothing was written");
    return error.exitCode();
  } catch (const MemoryExceeded& error) {
    complain(error.what());
    std::cerr << "The option --max-memory allows more.\n";
    return error.exitCode();
  } catch (...) {
    const Error error = currentFailure();
    complain(error.what());
    if (error.kind() == ErrorKind::kUsage)
      std::cerr << "Try '" << program << " --help' for more information.\n";
    return error.exitCode();
  }
}

}  // namespace esvr::cli
