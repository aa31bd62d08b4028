// image2vdb: converts dense images to VDB.

#include <array>
#include <charconv>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "cli/interrupts.h"
#include "cli/number_list.h"
#include "cli/output.h"
#include "cli/run_main.h"
#include "cli/thread_limit.h"
#include "images/element_type.h"
#include "images/image_files.h"
#include "images/image_format.h"
#include "images/image_volume.h"
#include "images/open_image.h"
#include "kinds/density_grid.h"
#include "programs/memory_limit.h"
#include "programs/write_output.h"

namespace {

using namespace esvr;
namespace po = cli::po;

constexpr const char* kName = "image2vdb";
constexpr const char* kRawOptions[] = {"dims", "type", "endian", "skip"};

cli::CommandLine commandLine() {
  cli::CommandLine line(
      {.name = kName,
       .purpose = "Converts a dense image to a sparse VDB grid.",
       .usage = "  image2vdb IN OUT.vdb [options]              TIFF, NIfTI, VTI, HDF5 or NRRD\n"
                "  image2vdb SLICE.tif... OUT.vdb [options]    a TIFF file for each slice\n"
                "  image2vdb IN.raw OUT.vdb --dims X,Y,Z --type TYPE [options]",
       .notes =
           samples::textOfFormats() +
           " The format of IN follows from its content, or else from its name. The slices of a "
           "TIFF stack are the pages of one file, files in the order given, the TIFF files of "
           "a folder, or those of a pattern such as 'slice_####.tif'. In a RAW file, x varies "
           "fastest, and TYPE is one of " +
           samples::elementTypeNames() +
           ".\n"
           "\n"
           "The values of the grid are 32-bit floats. A voxel is active if it is not below "
           "the threshold, or, without a threshold, if it differs from the background. The "
           "transform of the grid is that of the image: the space directions and origin of "
           "NRRD, the sform or qform of NIfTI, the origin, spacing and direction of VTI, the "
           "sizes of voxels that ImageJ or OME wrote into TIFF, and element_size_um of HDF5.",
       .examples =
           "  image2vdb scan.tif scan.vdb\n"
           "  image2vdb 'slices/ct_####.tif' ct.vdb --voxel-size 0.5,0.5,2 --threshold 300\n"
           "  image2vdb brain.nii.gz brain.vdb --threshold 40\n"
           "  image2vdb pressure.vti pressure.vdb --dataset p --background 1\n"
           "  image2vdb cells.h5 cells.vdb --dataset /volumes/raw --normalise\n"
           "  image2vdb aneurism_256x256x256_uint8.raw aneurism.vdb --dims 256,256,256 \\\n"
           "      --type uint8 --threshold 32 --normalise"});
  line.argument("input", "IN");
  line.repeatedArgument("more");
  // clang-format off
  line.options().add_options()
    ("dims", po::value<std::string>()->value_name("X,Y,Z"), "RAW: number of voxels along each axis")
    ("type", po::value<std::string>()->value_name("TYPE"), "RAW: type of the values")
    ("endian", po::value<std::string>()->value_name("little|big"),
     "RAW: byte order (default: little)")
    ("skip", po::value<std::int64_t>()->value_name("BYTES"),
     "RAW: length of a header (default: 0)")
    ("voxel-size", po::value<std::string>()->value_name("S|X,Y,Z"),
     "edges of a voxel in world units, instead of the transform of the image")
    ("component", po::value<std::int64_t>()->value_name("K"),
     "which of several colors, channels, directions or times, from 0 on")
    ("dataset", po::value<std::string>()->value_name("PATH"),
     "HDF5: path of the dataset; VTI: name of the array")
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

/// The edges of voxels that the user gives, as one number or three.
std::optional<std::array<double, 3>> voxelSize(const cli::Arguments& arguments) {
  constexpr double kSmallest = 1e-4, kLargest = 1e30;  // OpenVDB treats volumes of 1e-15 as 0
  constexpr const char* kOption = "voxel-size";
  const auto text = arguments.find<std::string>(kOption);
  if (!text) return std::nullopt;
  const bool isOne = text->find(',') == std::string::npos;
  const auto edges = cli::parseNumbers(kOption, *text, isOne ? 1 : 3);
  for (const double edge : edges) cli::requireRange(kOption, edge, kSmallest, kLargest);
  return std::array{edges.front(), edges[edges.size() / 2], edges.back()};
}

/// The layout of a RAW image; nothing if it is not given.
std::optional<samples::RawLayout> layoutFrom(const cli::Arguments& arguments) {
  if (!arguments.has("dims") || !arguments.has("type")) return std::nullopt;
  const auto skip = arguments.find<std::int64_t>("skip").value_or(0);
  cli::requireRange("skip", skip, std::int64_t{0}, std::numeric_limits<std::int64_t>::max());
  return samples::RawLayout{.size = parseDims(arguments.get<std::string>("dims")),
                            .type = arguments.get<std::string>("type"),
                            .bigEndian = isSecond(arguments, "endian", "little", "big"),
                            .headerBytes = std::uint64_t(skip)};
}

void refuseRawOptions(const cli::Arguments& arguments, const samples::ImageFiles& files) {
  const samples::ImageFormat format = samples::imageFormat(files.paths.front());
  if (format == samples::ImageFormat::kRaw) return;
  for (const char* option : kRawOptions)
    if (arguments.has(option))
      throw UsageError("--" + std::string(option) + " is for RAW images only, and " +
                       files.paths.front().string() + " has the format " + samples::nameOf(format));
}

/// The arguments without a dash: the files of the image, then the output.
std::vector<std::string> fileArguments(const cli::Arguments& arguments) {
  std::vector<std::string> files{arguments.get<std::string>("input")};
  const auto more = arguments.find<std::vector<std::string>>("more");
  if (!more) throw UsageError("missing argument OUT.vdb");
  files.insert(files.end(), more->begin(), more->end());
  return files;
}

samples::ImageRequest requestFrom(const cli::Arguments& arguments,
                                  const samples::ImageFiles& files) {
  refuseRawOptions(arguments, files);
  return {.paths = files.paths,
          .raw = layoutFrom(arguments),
          .choice = {.component = arguments.find<std::int64_t>("component"),
                     .dataset = arguments.find<std::string>("dataset")}};
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

Transform transformOf(const cli::Arguments& arguments, const samples::ImageSource& image) {
  const auto edges = voxelSize(arguments);
  try {
    return affineTransform(edges ? samples::scaleMatrix(*edges) : image.indexToWorld());
  } catch (const UsageError& error) {
    throw BadInput(arguments.get<std::string>("input") +
                   ": the axes are linearly dependent, or voxels are too small for OpenVDB: " +
                   error.what() + " (--voxel-size gives others)");
  }
}

int run(int argc, char** argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return 0;
  const samples::ImageOptions options = imageOptions(*arguments);
  auto names = fileArguments(*arguments);
  const samples::Output output{names.back(), arguments->get<bool>("force")};
  names.pop_back();
  cli::requireSeparate({names.begin(), names.end()}, {output.path});
  const cli::WatchedInputs watched({names.begin(), names.end()});
  cli::checkOutput(output.path, {".vdb", ".nvdb"}, output.overwrite);
  const samples::ImageFiles files = samples::imageFiles(names);
  const auto image = samples::openImage(requestFrom(*arguments, files));
  const Transform transform = transformOf(*arguments, *image);

  const cli::Log log(kName, arguments->verbosity);
  if (files.outOfOrder)
    log.warning(
        "the slices are in the order given, which is not that of the numbers in their names");
  if (!files.hint.empty()) log.warning(files.hint);
  const cli::ThreadLimit threads(arguments->threads);
  const cli::Interrupts interrupts;
  samples::ImageVolume made = volumeOf(
      *image, options, {.maxBricks = samples::bricksThatFit(), .cancel = &interrupts.token()});
  if (made.nonFiniteReplaced > 0)
    log.warning(std::to_string(made.nonFiniteReplaced) + " voxels were not finite and are now 0");
  const std::vector<VolumeGrid> grids{
      samples::densityGrid(std::move(made.volume), transform, arguments->get<std::string>("name"))};
  watched.requireUnchanged();
  samples::writeOutput(output, std::vector{stringItem("creator", kName)}, grids, log);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return cli::runMain(kName, [&] { return run(argc, argv); });
}
