// image2vdb: converts dense images (RAW and NRRD) to VDB.

#include <charconv>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "cli/interrupts.h"
#include "cli/output.h"
#include "cli/run_main.h"
#include "cli/thread_limit.h"
#include "images/image_source.h"
#include "images/image_volume.h"
#include "kinds/density_grid.h"
#include "programs/memory_limit.h"
#include "programs/write_output.h"

namespace {

using namespace esvr;
namespace po = cli::po;

constexpr const char* kName = "image2vdb";
constexpr const char* kRawOptions[] = {"dims", "type", "endian", "skip", "voxel-size"};

cli::CommandLine commandLine() {
  cli::CommandLine line(
      {.name = kName,
       .purpose = "Converts a dense image, RAW or NRRD, to a sparse VDB grid.",
       .usage = "  image2vdb IN.raw OUT.vdb --dims X,Y,Z --type TYPE [options]\n"
                "  image2vdb IN.nrrd|IN.nhdr OUT.vdb [options]",
       .notes =
           "TYPE is uint8, int8, uint16, int16, uint32, int32, float32 or float64. In the file, x\n"
           "varies fastest. The values of the grid are 32-bit floats. A voxel is active if it is\n"
           "not below the threshold, or, without a threshold, if it differs from the background.\n"
           "The transform of the grid follows from the space directions, origin and spacings of\n"
           "an NRRD image.",
       .examples = "  image2vdb aneurism_256x256x256_uint8.raw aneurism.vdb --dims 256,256,256 \\\n"
                   "      --type uint8 --threshold 32 --normalise\n"
                   "  image2vdb ct.nhdr ct.vdb --threshold 300"});
  line.argument("input", "IN");
  line.argument("output", "OUT.vdb");
  // clang-format off
  line.options().add_options()
    ("dims", po::value<std::string>()->value_name("X,Y,Z"), "RAW: number of voxels along each axis")
    ("type", po::value<std::string>()->value_name("TYPE"), "RAW: type of the values")
    ("endian", po::value<std::string>()->value_name("little|big"),
     "RAW: byte order (default: little)")
    ("skip", po::value<std::int64_t>()->value_name("BYTES"),
     "RAW: length of a header (default: 0)")
    ("voxel-size", po::value<double>()->value_name("S"),
     "RAW: edge of a voxel in world units (default: 1)")
    ("threshold", po::value<double>()->value_name("T"),
     "smallest value of active voxels, in the image's units")
    ("background", po::value<double>()->value_name("B")->default_value(0.0),
     "value of inactive voxels, in the image's units")
    ("normalise", po::bool_switch(),
     "divide by the type's largest value, or by the largest value of a float image")
    ("nonfinite", po::value<std::string>()->value_name("refuse|zero")->default_value("refuse"),
     "refuse: fail on NaN or infinite voxels; zero: replace them by 0")
    ("name", po::value<std::string>()->value_name("NAME")->default_value("density"),
     "name of the grid")
    ("force,f", po::bool_switch(), "replace OUT.vdb if it exists");
  // clang-format on
  return line;
}

/// Reads three positive numbers like "256,256,128".
Coord parseDims(const std::string& text) {
  std::int32_t dims[3] = {};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    const auto [next, error] = std::from_chars(at, end, dims[axis]);
    const bool separated = axis < 2 ? next != end && *next == ',' : next == end;
    if (error != std::errc() || !separated || dims[axis] < 1)
      throw UsageError("--dims must be three positive numbers like 256,256,128, not '" + text +
                       "'");
    at = next + 1;
  }
  return {dims[0], dims[1], dims[2]};
}

/// True for the second of two words. \throws UsageError  the value is neither
bool isSecond(const cli::Arguments& arguments, const std::string& option, const char* first,
              const char* second) {
  const auto given = arguments.find<std::string>(option).value_or(first);
  if (given != first && given != second)
    throw UsageError("--" + option + " must be " + first + " or " + second + ", not '" + given +
                     "'");
  return given == second;
}

samples::RawLayout layoutFrom(const cli::Arguments& arguments) {
  if (!arguments.has("dims") || !arguments.has("type"))
    throw UsageError(
        "a RAW image needs --dims and --type (a file ending in .nrrd or .nhdr does not)");
  constexpr double kSmallest = 1e-4, kLargest = 1e30;  // OpenVDB treats volumes of 1e-15 as 0
  const auto skip = arguments.find<std::int64_t>("skip").value_or(0);
  cli::requireRange("skip", skip, std::int64_t{0}, std::numeric_limits<std::int64_t>::max());
  samples::RawLayout layout{.size = parseDims(arguments.get<std::string>("dims")),
                            .type = arguments.get<std::string>("type"),
                            .bigEndian = isSecond(arguments, "endian", "little", "big"),
                            .headerBytes = std::uint64_t(skip),
                            .voxelSize = arguments.find<double>("voxel-size").value_or(1.0)};
  cli::requireRange("voxel-size", layout.voxelSize, kSmallest, kLargest);
  return layout;
}

std::unique_ptr<samples::ImageSource> openImage(const cli::Arguments& arguments) {
  const std::filesystem::path path = arguments.get<std::string>("input");
  if (path.extension() != ".nrrd" && path.extension() != ".nhdr")
    return samples::openRaw(path, layoutFrom(arguments));
  for (const char* option : kRawOptions)
    if (arguments.has(option))
      throw UsageError("--" + std::string(option) +
                       " is for RAW images only; an NRRD has its own header");
  return samples::openNrrd(path);
}

samples::ImageOptions imageOptions(const cli::Arguments& arguments) {
  samples::ImageOptions options{
      .threshold = arguments.find<double>("threshold"),
      .background = arguments.get<double>("background"),
      .normalise = arguments.get<bool>("normalise"),
      .zeroNonFinite = isSecond(arguments, "nonfinite", "refuse", "zero")};
  constexpr double kLargest = std::numeric_limits<float>::max();
  cli::requireRange("background", options.background, -kLargest, kLargest);
  if (options.threshold) cli::requireRange("threshold", *options.threshold, -kLargest, kLargest);
  return options;
}

Transform transformOf(const samples::ImageSource& image, const std::string& input) {
  try {
    return affineTransform(image.indexToWorld());
  } catch (const UsageError& error) {
    throw BadInput(input + ": the axes are linearly dependent: " + error.what());
  }
}

int run(int argc, char** argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return 0;
  const samples::ImageOptions options = imageOptions(*arguments);
  const samples::Output output{arguments->get<std::string>("output"),
                               arguments->get<bool>("force")};
  cli::checkOutput(output.path, {".vdb", ".nvdb"}, output.overwrite);
  const auto image = openImage(*arguments);
  const Transform transform = transformOf(*image, arguments->get<std::string>("input"));

  const cli::Log log(kName, arguments->verbosity);
  const cli::ThreadLimit threads(arguments->threads);
  const cli::Interrupts interrupts;
  samples::ImageVolume made = volumeOf(
      *image, options, {.maxBricks = samples::bricksThatFit(), .cancel = &interrupts.token()});
  if (made.nonFiniteReplaced > 0)
    log.warning(std::to_string(made.nonFiniteReplaced) + " voxels were not finite and are now 0");
  const std::vector<VolumeGrid> grids{
      samples::densityGrid(std::move(made.volume), transform, arguments->get<std::string>("name"))};
  samples::writeOutput(output, std::vector{stringItem("creator", kName)}, grids, log);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return cli::runMain(kName, [&] { return run(argc, argv); });
}
