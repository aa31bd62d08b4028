// esvr-sample: writes a generated sample to a VDB file.

#include <limits>
#include <string>

#include "cli/command_line.h"
#include "cli/interrupts.h"
#include "cli/output.h"
#include "cli/run_main.h"
#include "cli/thread_limit.h"
#include "kinds/sample_kinds.h"
#include "programs/memory_limit.h"
#include "programs/write_output.h"

namespace {

using namespace esvr;

constexpr const char* kName = "esvr-sample";
constexpr int kDefaultResolution = 256;
constexpr int kLargestResolution = 1 << 16;

std::string listOfKinds() {
  constexpr std::size_t kColumn = 16;
  std::string text;
  for (const samples::SampleKind& kind : samples::sampleKinds()) {
    std::string name = kind.name;
    name.resize(kColumn, ' ');
    text += "  " + name + kind.description + "\n";
  }
  return text;
}

cli::CommandLine commandLine() {
  cli::CommandLine line(
      {.name = kName,
       .purpose = "Generates a sparse volume and writes it as VDB. The same kind, resolution and\n"
                  "seed give the same voxels on every machine.",
       .usage = "  esvr-sample KIND OUT.vdb [--resolution N] [--seed N] [-f]",
       .notes = "KIND is one of\n" + listOfKinds() +
                "Time and memory are proportional to the active voxels, so resolutions of several\n"
                "thousand are possible.",
       .examples = "  esvr-sample tree tree.vdb\n"
                   "  esvr-sample plume smoke.vdb --resolution 512 --seed 7"});
  line.argument("kind", "KIND");
  line.argument("output", "OUT.vdb");
  // clang-format off
  line.options().add_options()
    ("resolution", cli::po::value<int>()->value_name("N")->default_value(kDefaultResolution),
     "voxels along the longest side")
    ("seed", cli::po::value<std::int64_t>()->value_name("N")->default_value(1),
     "seed of the random choices; each seed gives another volume of the kind")
    ("force,f", cli::po::bool_switch(), "replace OUT.vdb if it exists");
  // clang-format on
  return line;
}

int run(int argc, char** argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return 0;
  const auto resolution = arguments->get<int>("resolution");
  cli::requireRange("resolution", resolution, 1, kLargestResolution);
  const auto seed = arguments->get<std::int64_t>("seed");
  cli::requireRange("seed", seed, std::int64_t{0}, std::numeric_limits<std::int64_t>::max());
  const samples::SampleKind& kind = samples::sampleKind(arguments->get<std::string>("kind"));
  const samples::Output output{arguments->get<std::string>("output"),
                               arguments->get<bool>("force")};
  cli::checkOutput(output.path, {".vdb", ".nvdb"}, output.overwrite);

  const cli::ThreadLimit threads(arguments->threads);
  const cli::Interrupts interrupts;
  const samples::SampleFile file =
      kind.make({.resolution = resolution,
                 .seed = std::uint64_t(seed),
                 .limits = {.maxBricks = samples::bricksThatFit(), .cancel = &interrupts.token()}});
  samples::writeOutput(output, file.metadata, file.grids, cli::Log(kName, arguments->verbosity));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return cli::runMain(kName, [&] { return run(argc, argv); });
}
