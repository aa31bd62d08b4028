// esvr-sample: writes a generated sample to a VDB file.

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "esvr/error.h"
#include "generators/sample_kinds.h"
#include "programs/command_line.h"
#include "programs/files.h"
#include "programs/resources.h"
#include "programs/run_main.h"
#include "programs/sequence.h"
#include "sample_output.h"

namespace {

using namespace esvr;

constexpr const char* kName = "esvr-sample";
constexpr int kDefaultResolution = 256;
constexpr int kLargestResolution = 1 << 16, kMostFrames = 100'000;

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
       .purpose = "Generates a sparse volume and writes it as VDB. The same kind, resolution and "
                  "seed give the same voxels on every machine.",
       .usage = "  esvr-sample KIND OUT.vdb [--resolution N] [--seed N] [-f]\n"
                "  esvr-sample plume 'OUT.####.vdb' --frames N [--frame K]",
       .notes = "KIND is one of\n" + listOfKinds() +
                "Time and memory are proportional to the active voxels, so resolutions of several "
                "thousand are possible.",
       .examples = "  esvr-sample tree tree.vdb\n"
                   "  esvr-sample plume smoke.vdb --resolution 512 --seed 7\n"
                   "  esvr-sample plume 'smoke.####.vdb' --resolution 128 --frames 48"});
  line.argument("kind", "KIND");
  line.argument("output", "OUT.vdb");
  // clang-format off
  line.options().add_options()
    ("resolution", cli::po::value<int>()->value_name("N")->default_value(kDefaultResolution),
     "voxels along the longest side")
    ("seed", cli::po::value<std::int64_t>()->value_name("N")->default_value(1),
     "seed of the random choices; each seed gives another volume of the kind")
    ("frames", cli::po::value<int>()->value_name("N"),
     "write the frames 1 to N of a sample that moves, which is the plume; OUT.vdb must have a\n"
     "pattern for the number of the frame")
    ("frame", cli::po::value<int>()->value_name("K"), "write only frame K of --frames")
    ("force,f", cli::po::bool_switch(), "replace OUT.vdb if it exists");
  // clang-format on
  return line;
}

/// The path of each frame; one path if there is no sequence.
std::vector<std::filesystem::path> outputsOf(const cli::Arguments& arguments,
                                             const samples::SampleKind& kind) {
  const auto output = arguments.get<std::string>("output");
  if (!arguments.has("frames")) {
    if (arguments.has("frame")) throw UsageError("--frame needs --frames");
    return {output};
  }
  const auto frames = arguments.get<int>("frames");
  cli::requireRange("frames", frames, 1, kMostFrames);
  const auto pattern = cli::FramePattern::in(output);
  if (!kind.moves) throw UsageError(std::string("--frames: ") + kind.name + " does not move");
  if (!pattern)
    throw UsageError("--frames: " + output + " has no pattern for the frame, such as ####");
  std::vector<std::filesystem::path> paths;
  for (int frame = 1; frame <= frames; ++frame) paths.push_back(pattern->at(frame));
  return paths;
}

int run(int argc, char** argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return 0;
  const auto resolution = arguments->get<int>("resolution");
  cli::requireRange("resolution", resolution, 1, kLargestResolution);
  const auto seed = arguments->get<std::int64_t>("seed");
  cli::requireRange("seed", seed, std::int64_t{0}, std::numeric_limits<std::int64_t>::max());
  const samples::SampleKind& kind = samples::sampleKind(arguments->get<std::string>("kind"));
  const auto paths = outputsOf(*arguments, kind);
  const bool overwrite = arguments->get<bool>("force");
  std::size_t first = 0, last = paths.size() - 1;
  if (arguments->has("frame")) {
    const auto frame = arguments->get<int>("frame");
    cli::requireRange("frame", frame, 1, int(paths.size()));
    first = last = std::size_t(frame) - 1;
  }
  cli::requireSeparate(
      {}, {paths.begin() + std::ptrdiff_t(first), paths.begin() + std::ptrdiff_t(last) + 1});
  for (std::size_t f = first; f <= last; ++f)
    cli::checkOutput(paths[f], {".vdb", ".nvdb"}, overwrite);

  const cli::ThreadLimit threads(arguments->threads);
  const cli::Interrupts interrupts;
  const cli::Log log(kName, arguments->verbosity);
  std::size_t f = first;
  try {
    for (; f <= last; ++f) {
      const samples::SampleFile file = kind.make(
          {.resolution = resolution,
           .seed = std::uint64_t(seed),
           .frame = int(f),
           .limits = {.maxBricks = samples::bricksThatFit(), .cancel = &interrupts.token()}});
      samples::writeOutput({paths[f], overwrite}, file.metadata, file.grids, log);
    }
  } catch (const Cancelled&) {
    if (f == first) throw;
    throw RuntimeFailure("interrupted; " + cli::completeOf(std::uint64_t(f - first),
                                                           std::uint64_t(last - first + 1),
                                                           "frame"));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return cli::runMain(kName, [&] { return run(argc, argv); });
}
