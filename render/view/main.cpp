// esvr-view shows .esvr files and VDB files in a browser.

#include "cli/run_main.h"
#include "cli/thread_limit.h"
#include "render/view/options.h"
#include "render/view/run.h"

int main(int argc, char** argv) {
  using namespace esvr;
  return cli::runMain(view::kProgram, [&] {
    const auto options = view::parseOptions(argc, argv);
    if (!options) return 0;
    const cli::ThreadLimit threads(options->threads);
    view::run(*options);
    return 0;
  });
}
