// esvr-compare: how good is an ESVR, against its source and against what else could hold it.

#include <string_view>

#include "cli/command_line.h"
#include "cli/run_main.h"
#include "compare/check.h"
#include "compare/curves.h"
#include "compare/program.h"
#include "compare/table.h"

namespace {

using namespace esvr::compare;

/// For --help and --version without a job, and for a word that is none.
esvr::cli::CommandLine overview() {
  esvr::cli::CommandLine line(
      {.name = kProgram,
       .purpose = "Measures how far grids are from a reference.",
       .usage =
           "  esvr-compare check REF CAND            fails where a grid has drifted\n"
           "  esvr-compare table REF [CAND.esvr ...]   against what else could hold the volume\n"
           "  esvr-compare curves REF [CAND.esvr ...]  error over run time and over bytes",
       .notes = "esvr-compare JOB --help says more of each job.",
       .examples = "  esvr-compare check smoke.vdb smoke.esvr --min-psnr 45"});
  line.argument("job", "JOB: check, table or curves");
  return line;
}

void run(int argc, const char* const* argv) {
  const std::string_view job = argc > 1 ? argv[1] : "";
  if (job == "check") {
    if (const auto options = parseCheckOptions(argc - 1, argv + 1)) check(*options);
    return;
  }
  if (job == "table") {
    if (const auto options = parseTableOptions(argc - 1, argv + 1)) table(*options);
    return;
  }
  if (job == "curves") {
    if (const auto options = parseCurvesOptions(argc - 1, argv + 1)) curves(*options);
    return;
  }
  if (const auto arguments = overview().parse(argc, argv))
    throw esvr::UsageError("no job is called '" + arguments->get<std::string>("job") +
                           "'; there are: check, table, curves");
}

}  // namespace

int main(int argc, char** argv) {
  return esvr::cli::runMain(kProgram, [&] {
    run(argc, argv);
    return 0;
  });
}
