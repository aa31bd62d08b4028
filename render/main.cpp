// esvr-render draws the ellipsoids of an .esvr file or the voxels of a VDB file.

#include "cli/run_main.h"
#include "cli/thread_limit.h"
#include "render/options.h"
#include "render/run.h"

int main(int argc, char** argv) {
  using namespace esvr;
  return cli::runMain(render::kProgram, [&] {
    const auto options = render::parseOptions(argc, argv);
    if (!options) return 0;
    const cli::ThreadLimit threads(options->threads);
    render::run(*options);
    return 0;
  });
}
