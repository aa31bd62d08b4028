// vdb2esvr: fits ellipsoids to the grids of a VDB file.

#include "cli/run_main.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/run.h"

int main(int argc, char** argv) {
  using namespace esvr;
  return cli::runMain(vdb2esvr::kProgram, [&] {
    const auto options = vdb2esvr::parseOptions(argc, argv);
    return options ? vdb2esvr::run(*options) : 0;
  });
}
