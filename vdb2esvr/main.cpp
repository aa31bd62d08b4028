// vdb2esvr: fits ellipsoids to the grids of a VDB file.

#include <memory>

#include "cli/run_main.h"
#include "esvr/error.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/run.h"

int main(int argc, char** argv) {
  using namespace esvr;
  std::unique_ptr<Ranks> ranks;
  const int code = cli::runMain(vdb2esvr::kProgram, [&] {
    const auto options = vdb2esvr::parseOptions(argc, argv);
    if (!options) return 0;
    ranks = joinRanks();
    return vdb2esvr::run(*options, ranks.get());
  });
  // The other ranks would wait for one that failed. Where a target was missed, all have ended.
  if (ranks && code != 0 && code != int(ErrorKind::kTargetMissed)) ranks->abort(code);
  return code;
}
