// esvr-compare: compares .esvr files with their source and with other ways to store it.

#include <string>
#include <string_view>
#include <vector>

#include "compare/check.h"
#include "compare/figures.h"
#include "compare/table.h"
#include "esvr/did_you_mean.h"
#include "esvr/error.h"
#include "programs/command_line.h"
#include "programs/run_main.h"

namespace {

using namespace esvr::compare;

/// The command line without a command, for --help and --version.
esvr::cli::CommandLine overview() {
  esvr::cli::CommandLine line(
      {.name = kProgram,
       .purpose = "Compares grids with a reference.",
       .usage = "  esvr-compare check REF CAND              fail if a grid differs too much\n"
                "  esvr-compare table REF [CAND.esvr ...]   compare with other ways to store the "
                "volume",
       .notes = "esvr-compare COMMAND --help describes each command.",
       .examples = "  esvr-compare check smoke.vdb smoke.esvr --min-psnr 45"});
  line.argument("command", "COMMAND: check or table");
  return line;
}

const std::vector<std::string> kCommands{"check", "table"};

void run(int argc, const char* const* argv) {
  const std::string_view command = argc > 1 ? argv[1] : "";
  if (command == "check") {
    if (const auto options = parseCheckOptions(argc - 1, argv + 1)) check(*options);
    return;
  }
  if (command == "table") {
    if (const auto options = parseTableOptions(argc - 1, argv + 1)) table(*options);
    return;
  }
  if (!command.empty() && command.front() != '-')
    throw esvr::UsageError("unknown command '" + std::string(command) +
                           "'; the commands are check and table" +
                           esvr::didYouMean(command, kCommands));
  (void)overview().parse(argc, argv);
}

}  // namespace

int main(int argc, char** argv) {
  return esvr::cli::runMain(kProgram, [&] {
    run(argc, argv);
    return 0;
  });
}
