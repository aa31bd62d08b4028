#include "compare/stability_options.h"

#include "cli/command_line.h"
#include "cli/device_option.h"
#include "compare/program.h"
#include "compare/report_options.h"

namespace esvr::compare {
namespace {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;

constexpr int kDefaultSamples = 256, kMostSamples = 10000;
constexpr double kDefaultDifference = 1e-4;

cli::ProgramText programText() {
  return {
      .name = std::string(kProgram) + " stability",
      .purpose =
          "Compares the float32 evaluation of the ellipsoids of a file with their definition in "
          "float64, and fails if a grid differs too much.",
      .usage = "  esvr-compare stability FILE.esvr [--max-difference X] [--report FILE.json]",
      .notes =
          "FILE is an .esvr file, or a sequence: a pattern such as smoke.####.esvr, or an .esvr "
          "file that holds a sequence. Each grid is evaluated on bricks of 8^3 voxels that are "
          "spread over its volume, and on those in which its most extreme ellipsoids are centered. "
          "The sum of the ellipsoids is compared with its definition at all voxels of these "
          "bricks, after both were clamped as a reader clamps them. The peak of a grid is that "
          "of the PSNR of its source, which is the largest value of a density. Grids that are "
          "stored "
          "as voxels have no sum; they are listed, and never fail.\n"
          "\n"
          "The table has the largest and the root mean square difference, the bound that follows "
          "from the arithmetic (docs/math.md), the correct decimal digits below the peak, and what "
          "makes a sum difficult: extreme scales and aspect ratios, the condition number of Sigma, "
          "kappa, overlap (ellipsoids at a voxel) and cancellation (sum of the magnitudes of the "
          "terms, divided by the magnitude of their sum).\n"
          "\n"
          "Exit codes: 0 within the limit, 1 failure, 2 wrong options, 3 unusable input, 4 a grid "
          "differs too much, 5 no such device or not enough memory (--max-memory).",
      .examples =
          "  esvr-compare stability smoke.esvr\n"
          "  esvr-compare stability smoke.esvr --max-difference 1e-6 --device cpu\n"
          "  esvr-compare stability 'smoke.####.esvr' --frames 1-100x10 --report stability.json"};
}

cli::CommandLine makeCommandLine() {
  cli::CommandLine line(programText());
  line.argument("file", "FILE.esvr");
  auto& options = line.options();
  // clang-format off
  options.add_options()
    ("grid,g", value<std::vector<std::string>>()->value_name("NAME")->composing(),
     "measure this grid only; may be repeated")
    ("frames", value<std::string>()->value_name("RANGE"),
     "of a sequence: the frames to measure, for example 1-100x2 (default: all)")
    ("bricks", value<int>()->value_name("N")->default_value(kDefaultSamples),
     "number of bricks of each grid that are compared, up to 10000")
    ("max-difference", value<double>()->value_name("X")->default_value(kDefaultDifference, "1e-4"),
     "largest difference of a voxel, as a share of the peak of its grid");
  // clang-format on
  cli::addDevice(options, "device that is measured beside the CPU: ");
  addJsonReport(options);
  options.add_options()("force,f", bool_switch(), "replace the report if it exists");
  cli::addHostMemory(line);
  return line;
}

}  // namespace

std::optional<StabilityRequest> parseStabilityOptions(int argc, const char* const* argv) {
  const auto arguments = makeCommandLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const Arguments& a = *arguments;
  StabilityRequest request;
  request.file = a.get<std::string>("file");
  if (const auto range = a.find<std::string>("frames"))
    request.frames = cli::parseFrames("frames", *range);
  request.grids = a.find<std::vector<std::string>>("grid").value_or(std::vector<std::string>{});
  const int samples = a.get<int>("bricks");
  cli::requireRange("bricks", samples, 1, kMostSamples);
  request.samples = std::size_t(samples);
  request.maxDifference = a.get<double>("max-difference");
  cli::requireRange("max-difference", request.maxDifference, 0.0, 1.0);
  request.device = cli::deviceOf(a);
  request.report = a.find<std::string>("report").value_or("");
  request.overwrite = a.get<bool>("force");
  request.memory = cli::hostMemoryOf(a);
  request.threads = a.threads;
  request.verbosity = a.verbosity;
  request.commandLine = commandLine(argc, argv);
  return request;
}

}  // namespace esvr::compare
