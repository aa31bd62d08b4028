// esvr2vdb: converts an .esvr file back to a VDB, or lists its content.

#include "cli/run_main.h"
#include "cli/thread_limit.h"
#include "esvr2vdb/jobs.h"
#include "esvr2vdb/options.h"

namespace {

using namespace esvr::esvr2vdb;

void run(const Options& options) {
  const esvr::cli::ThreadLimit threads(options.threads);
  switch (options.job) {
    case Job::kConvert:
      return options.sequence ? convertSequence(options) : convert(options);
    case Job::kList:
      return list(options);
    case Job::kCheck:
      return check(options);
  }
}

}  // namespace

int main(int argc, char** argv) {
  return esvr::cli::runMain(kProgram, [&] {
    if (const auto options = parseOptions(argc, argv)) run(*options);
    return 0;
  });
}
