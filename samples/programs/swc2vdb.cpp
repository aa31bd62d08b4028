// swc2vdb: converts a neuron skeleton to a volume.

#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "generators/sample_kinds.h"
#include "generators/tubes.h"
#include "programs/command_line.h"
#include "programs/files.h"
#include "programs/resources.h"
#include "programs/run_main.h"
#include "sample_output.h"

namespace {

using namespace esvr;

constexpr const char* kName = "swc2vdb";
constexpr int kDefaultResolution = 512;
constexpr int kLargestResolution = 1 << 16;
constexpr double kWidest = 1000.0;  // largest radius and edge, voxels
constexpr double kSharpest = 1e-3;  // narrowest edge, voxels

cli::CommandLine commandLine() {
  cli::CommandLine line(
      {.name = kName,
       .purpose =
           "Converts a neuron skeleton (SWC) to a VDB of soft-edged tubes: 1 inside, 0 outside.",
       .usage = "  swc2vdb IN.swc OUT.vdb [--resolution N] [--min-radius R] [--longest K]",
       .notes =
           "The grid 'density' has the position and the units of the skeleton. The radius changes "
           "linearly between two nodes. Time and memory are proportional to the active voxels.",
       .examples = "  swc2vdb neuron.swc neuron.vdb --resolution 1024\n"
                   "  swc2vdb neuron.swc large.vdb --resolution 8192 --min-radius 2"});
  line.argument("input", "IN.swc");
  line.argument("output", "OUT.vdb");
  // clang-format off
  line.options().add_options()
    ("resolution", cli::po::value<int>()->value_name("N")->default_value(kDefaultResolution),
     "voxels along the skeleton's longest side")
    ("min-radius", cli::po::value<double>()->value_name("R")->default_value(samples::kThinnestTube),
     "smallest radius of a tube in voxels; thinner tubes are thickened")
    ("edge", cli::po::value<double>()->value_name("E")->default_value(samples::kDefaultEdge),
     "width of the soft edge in voxels")
    ("longest", cli::po::value<std::int64_t>()->value_name("K"),
     "keep only the K connected pieces with the longest cable")
    ("force,f", cli::po::bool_switch(), "replace OUT.vdb if it exists");
  // clang-format on
  return line;
}

struct Options {
  samples::TubeScale scale;
  double edge = 0.0;
  std::optional<std::int64_t> longest;
};

Options optionsFrom(const cli::Arguments& arguments) {
  Options options;
  options.scale.resolution = arguments.get<int>("resolution");
  options.scale.minRadius = arguments.get<double>("min-radius");
  options.edge = arguments.get<double>("edge");
  options.scale.margin = int(std::ceil(options.edge / 2.0));
  options.longest = arguments.find<std::int64_t>("longest");
  cli::requireRange("resolution", options.scale.resolution, 1, kLargestResolution);
  cli::requireRange("min-radius", options.scale.minRadius, 0.0, kWidest);
  cli::requireRange("edge", options.edge, kSharpest, kWidest);
  if (options.longest)
    cli::requireRange("longest", *options.longest, std::int64_t{1},
                      std::numeric_limits<std::int64_t>::max());
  return options;
}

Transform transformOf(const samples::ScaledTubes& scaled) {
  const double s = scaled.voxelSize;
  const samples::Vec3 o = scaled.origin;
  try {
    return affineTransform({s, 0, 0, 0, 0, s, 0, 0, 0, 0, s, 0, o.x, o.y, o.z, 1});
  } catch (const UsageError&) {
    throw BadInput("the skeleton is too small for OpenVDB: a voxel would be 10^" +
                   std::to_string(int(std::floor(std::log10(s)))) +
                   " units wide. Scale it, or lower --resolution");
  }
}

VolumeGrid gridOf(const samples::Skeleton& skeleton, const Options& options,
                  const samples::Limits& limits) {
  const auto scaled = samples::fitTubes(samples::tubesOf(skeleton), options.scale);
  const Transform transform = transformOf(scaled);
  return samples::densityGrid(samples::voxeliseTubes(scaled.tubes, options.edge, limits),
                              transform);
}

int run(int argc, char** argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return 0;
  const Options options = optionsFrom(*arguments);
  const samples::Output output{arguments->get<std::string>("output"),
                               arguments->get<bool>("force")};
  const std::string input = arguments->get<std::string>("input");
  cli::requireSeparate({input}, {output.path});
  cli::checkOutput(output.path, {".vdb", ".nvdb"}, output.overwrite);
  const cli::Log log(kName, arguments->verbosity);

  std::istringstream text(cli::readText(input));
  samples::Skeleton skeleton = samples::parseSwc(text, input);
  if (options.longest) skeleton = samples::longestPieces(skeleton, std::size_t(*options.longest));
  log.detail(std::to_string(skeleton.size()) + " nodes");

  const cli::ThreadLimit threads(arguments->threads);
  const cli::Interrupts interrupts;
  const std::vector<VolumeGrid> grids{gridOf(
      skeleton, options, {.maxBricks = samples::bricksThatFit(), .cancel = &interrupts.token()})};
  samples::writeOutput(output, std::vector{stringItem("creator", kName)}, grids, log);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return cli::runMain(kName, [&] { return run(argc, argv); });
}
