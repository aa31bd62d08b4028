// esvr2vdb: writes VDB files from .esvr files, and lists and checks them. This file has the options and
// the main function.
#include <filesystem>
#include <limits>

#include "esvr/transfer_function.h"
#include "esvr2vdb/jobs.h"

#include "programs/command_line.h"
#include "programs/option_values.h"
#include "programs/resources.h"
#include "programs/run_main.h"

namespace esvr::esvr2vdb {
namespace {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;

cli::ProgramText programText() {
  return {
      .name = kProgram,
      .purpose =
          "Converts an .esvr file back to VDB. Names, transforms, metadata and background are "
          "exactly those of the source; voxels have the accuracy that was chosen when the file was "
          "made. Grids that vdb2esvr carried unchanged come back bit for bit, and all grids in "
          "their order. It also writes the ellipsoids of a grid as 3D Gaussian splats, and a VDB "
          "from splats. --list lists the contents of a file, --check verifies it.",
      .usage =
          "  esvr2vdb IN.esvr OUT.vdb [-g NAME]... [--threshold T] [--reference REF.vdb]\n"
          "  esvr2vdb IN.####.esvr|IN.esvr OUT.####.vdb [--frames 1-100] ...\n"
          "  esvr2vdb IN.esvr OUT.ply|OUT.usda [-g NAME] [--colors C] [--density-scale D] ...\n"
          "  esvr2vdb IN.ply OUT.vdb [--voxel-size S] [--density-scale D] [--up A]\n"
          "  esvr2vdb --list IN.esvr|IN.vdb|IN.nvdb|IN.ply|IN.####.vdb\n"
          "  esvr2vdb --check IN.esvr|IN.####.esvr",
      .notes =
          "IN and REF.vdb may be - for standard input, or a pipe.\n"
          "\n"
          "If OUT ends in .nvdb, a NanoVDB file is written. It cannot hold the metadata of the "
          "file and of its grids, and of carried grids it gets those of floats, doubles and "
          "vectors. --lod, --max-ellipsoids and --bbox do not write carried grids, because they "
          "cannot be cut. A warning names each grid that is left out, and naming such a grid with "
          "-g is an error.\n"
          "\n"
          "A voxel is active where it differs from the background by more than a threshold, which "
          "was chosen when the file was made, or where the file has a mask that says so. The "
          "bounding box of the active voxels is that of the source. In a level set, the voxels of "
          "the narrow band are active.\n"
          "\n"
          "--list also prints the creator of a file or a grid, the frame rate (an item of metadata "
          "such as fps or frame_rate) and every item whose name has the word unit or units. It "
          "counts bytes that several grids share for the first of them only. The table of sections "
          "names the grid with which a section is shared.\n"
          "\n"
          "Splats have the optical depth of the grid (docs/splats.md): the extinction over a unit "
          "of the world is --density-scale times the value, by default such that the median column "
          "lets half of the light through. A .ply file has y down and its longest side is 10; its "
          "comments say where it is in the world. From a .ply file, OUT.vdb gets the grid "
          "\"density\" and, with colors, the vectors \"Cd\".\n"
          "\n"
          "If IN.esvr holds a sequence, OUT needs a pattern such as #### for the number of the "
          "frame in the name of the file, unless --frames names a single frame. --list prints its "
          "frames and groups, and --check names each frame that is lost. With a pattern, --list "
          "prints a row for the file of each frame, and --check checks each of them.\n"
          "\n"
          "Exit codes: 0 done, 1 failure, 2 wrong options, 3 input that is damaged or cannot be "
          "used, 5 not enough memory (--max-memory). A sequence has the code of its first frame "
          "that failed.",
      .examples =
          "  esvr2vdb smoke.esvr smoke.vdb\n"
          "  esvr2vdb smoke.esvr back.vdb --reference smoke.vdb   # also print the errors\n"
          "  esvr2vdb smoke.esvr density.nvdb -g density\n"
          "  esvr2vdb smoke.esvr coarse.vdb --lod 1               # a preview\n"
          "  esvr2vdb smoke.esvr half.vdb --coarsen 2             # averages of 2 x 2 x 2 voxels\n"
          "  esvr2vdb smoke.esvr part.vdb --bbox 0,0,0,63,63,63   # a part of the voxels\n"
          "  esvr2vdb smoke.esvr 'back.####.vdb' --frames 10-20   # frames of a sequence\n"
          "  esvr2vdb smoke.esvr smoke.ply --colors 0.9,0.9,0.9   # splats for viewers\n"
          "  esvr2vdb smoke.esvr smoke.usda --colors inferno      # splats for USD\n"
          "  esvr2vdb splats.ply cloud.vdb --voxel-size 0.5       # a density from splats\n"
          "  esvr2vdb --list smoke.vdb"};
}

cli::CommandLine commandLine() {
  cli::CommandLine line(programText());
  line.argument("input", "IN.esvr");
  line.optionalArgument("output", "OUT.vdb");
  line.volumeInputs({"input", "reference"});
  // clang-format off
  line.options().add_options()
    ("list", bool_switch(),
     "list the grids of IN, which may be a VDB or splats, and the sections of an .esvr file")
    ("check", bool_switch(), "read all of IN.esvr, verify its checksums and print OK")
    ("grid,g", value<std::vector<std::string>>()->value_name("NAME")->composing(),
     "write this grid only; may be repeated; 'density[1]' is the second grid of that name")
    ("threshold", value<float>()->value_name("T"),
     "make the voxels active that differ from the background by more than T (default: the stored "
     "threshold or mask)")
    ("lod", value<std::int64_t>()->value_name("N"),
     "use only the first N importance layers; --list -v prints the error of each layer")
    ("max-ellipsoids", value<std::int64_t>()->value_name("N"),
     "use only the N ellipsoids of each grid that contribute most to its values")
    ("bbox", value<std::string>()->value_name("BOX"),
     "write only the voxels of the box x0,y0,z0,x1,y1,z1; ellipsoids that cannot reach the box are "
     "not read")
    ("coarsen", value<std::string>()->value_name("F"),
     "write voxels that are 2, 4 or 8 times as large along each axis and have the average of those in them; auto: as "
     "much as --max-memory needs")
    ("half", value<std::string>()->value_name("W")->default_value("auto"),
     "save the values of a .vdb as half floats: on, off, or auto (as the source did)")
    ("no-tiles", bool_switch(), "write leaves whose voxels are all equal as leaves, not as tiles")
    ("reference", value<std::string>()->value_name("REF.vdb"),
     "print the errors of the written grids against the grids of this file")
    ("box", value<std::string>()->value_name("BOX"),
     "box of voxels x0,y0,z0,x1,y1,z1 over which PSNR is measured (default: the bounding box of "
     "the reference's active voxels)")
    ("colors", value<std::string>()->value_name("C")->default_value("viridis"),
     "colors of splats over the range of the values and the background: a color map of esvr-render, the file of "
     "a ParaView preset, or one color R,G,B with channels from 0 to 1")
    ("kind", value<std::string>()->value_name("K")->default_value("viewer"),
     "form of OUT.ply: viewer (y down, longest side 10), or mitsuba (for the shape ellipsoids of Mitsuba 3, in "
     "the world)")
    ("force,f", bool_switch(), "replace OUT.vdb if it exists");
  // clang-format on
  cli::addSplatInput(
      line.options(),
      "side of a voxel in units of the world: of a grid made of splats (default: as in their grid, "
      "or 1/256 of their box), or of grids of IN.esvr, which are averaged or, if they are "
      "ellipsoids, evaluated between the voxels (default: as in the source)");
  cli::addSequenceOptions(line.options());
  cli::addHostMemory(line);
  line.mainOptions({"list", "check", "grid", "lod", "bbox", "coarsen", "reference", "colors",
                    "voxel-size", "force", "frames"});
  return line;
}

Job jobOf(const Arguments& a) {
  const bool list = a.get<bool>("list"), check = a.get<bool>("check");
  if (list && check) throw UsageError("--list and --check are two jobs; ask for one");
  if (!list && !check) return Job::kConvert;
  for (const char* option :
       {"output", "grid", "threshold", "lod", "max-ellipsoids", "bbox", "coarsen", "voxel-size",
        "reference", "box", "frames", "missing", "on-error"})
    if (a.has(option))
      throw UsageError(std::string(list ? "--list" : "--check") + " takes IN only, no " + option);
  return list ? Job::kList : Job::kCheck;
}

std::filesystem::path outputOf(const Arguments& a) {
  if (!a.has("output")) throw UsageError("missing argument OUT.vdb");
  return a.get<std::string>("output");
}

std::optional<std::size_t> countOf(const Arguments& a, const char* option) {
  const auto given = a.find<std::int64_t>(option);
  if (!given) return std::nullopt;
  cli::requireRange(option, *given, std::int64_t{1}, std::numeric_limits<std::int64_t>::max());
  return std::size_t(*given);
}

void readPart(const Arguments& a, Options& options) {
  options.part.layers = countOf(a, "lod");
  options.part.ellipsoids = options.maxEllipsoids = countOf(a, "max-ellipsoids");
  if (const auto box = a.find<std::string>("bbox"))
    options.part.box = options.decode.box = cli::parseBox(*box, "bbox");
}

/// The colors over the values 0 to 1. \throws UsageError, BadInput  they cannot be read
ColorMap colorsOf(const Arguments& a) {
  const auto& text = a.get<std::string>("colors");
  if (text.find(',') != text.npos) {
    const auto c = cli::parseNumbers("colors", text, 3);
    for (const double channel : c) cli::requireRange("colors", channel, 0.0, 1.0);
    return {.points = {{0.0, {c[0], c[1], c[2]}}}};
  }
  if (std::filesystem::path(text).has_extension()) return readParaViewPreset(text).colors;
  return builtInColorMap(text);
}

void readSplats(const Arguments& a, Options& options) {
  const bool isRead = cli::isSplatFile(options.input), isWritten = writesSplats(options);
  if (!isRead && !isWritten)
    cli::refuseOptions(a, "files without splats", {"colors", "kind", "density-scale", "up"});
  if (isRead && isWritten) throw UsageError("splats are not converted to splats");
  if (isRead)
    cli::refuseOptions(a, "splats in the input",
                       {"grid", "threshold", "lod", "max-ellipsoids", "bbox", "coarsen",
                        "reference", "box", "colors", "kind"});
  if (isWritten)
    cli::refuseOptions(a, "splats in the output",
                       {"threshold", "reference", "box", "half", "coarsen", "voxel-size"});
  if (options.output.extension() == ".usda") cli::refuseOptions(a, "USD", {"kind"});
  if (options.sequence && isRead)
    throw UsageError("splats are read from one file at a time; name a file without a pattern");
  options.splats.read = cli::splatInputOf(a);
  if (!isRead)
    options.resolution =
        resolutionOf(a.find<std::string>("coarsen"), options.splats.read.voxelSize);
  options.splats.made = {
      .form = cli::choiceOf<SplatForm>(
          a, "kind", {{"viewer", SplatForm::kPly}, {"mitsuba", SplatForm::kMitsuba}}),
      .up = options.splats.read.up,
      .colors = isWritten ? colorsOf(a) : ColorMap{},
      .densityScale = options.splats.read.densityScale};
}

void readConversion(const Arguments& a, Options& options) {
  options.output = outputOf(a);
  options.grids = a.all("grid");
  options.decode.threshold = a.find<float>("threshold");
  if (options.decode.threshold)
    cli::requireRange("threshold", *options.decode.threshold, 0.0f,
                      std::numeric_limits<float>::max());
  readPart(a, options);
  options.write.half = cli::choiceOf<HalfMode>(
      a, "half", {{"auto", HalfMode::kAuto}, {"on", HalfMode::kOn}, {"off", HalfMode::kOff}});
  options.write.constantTiles = !a.get<bool>("no-tiles");
  options.write.overwrite = a.get<bool>("force");
  options.reference = a.find<std::string>("reference");
  if (const auto box = a.find<std::string>("box")) options.box = cli::parseBox(*box);
  if (options.box && !options.reference) throw UsageError("--box says nothing without --reference");
  options.sequence = cli::readSequence(a, {.input = true, .outputOfOneFrame = true});
  if (options.sequence && options.reference &&
      !cli::FramePattern::ofInput(options.reference->string()))
    throw UsageError("--reference needs a pattern for the number of a frame, because '" +
                     options.input.string() + "' is a sequence");
  readSplats(a, options);
  if (options.sequence && options.resolution.isAuto)
    throw UsageError("--coarsen auto may give frames voxels of several sizes; name a factor");
  if (options.reference && changesResolution(options))
    throw UsageError(
        "--reference compares voxels of one size; leave out --coarsen and --voxel-size");
}

/// \return nothing if --help or --version was printed
/// \throws UsageError  an option is invalid
std::optional<Options> parseOptions(int argc, const char* const* argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  Options options;
  options.job = jobOf(*arguments);
  options.input = arguments->get<std::string>("input");
  options.inputs = arguments->inputs;
  options.threads = arguments->threads;
  options.verbosity = arguments->verbosity;
  options.memory = cli::hostMemoryOf(*arguments);
  options.write.maxBytes = options.memory.maxBytes;
  if (options.job == Job::kConvert) readConversion(*arguments, options);
  return options;
}

void run(const Options& options) {
  const cli::ThreadLimit threads(options.threads);
  switch (options.job) {
    case Job::kConvert:
      if (cli::isSplatFile(options.input)) return importSplats(options);
      return options.sequence ? convertSequence(options) : convert(options);
    case Job::kList:
      return list(options);
    case Job::kCheck:
      return check(options);
  }
}

}  // namespace

bool readsAll(const Options& options) {
  const ReadPart& part = options.part;
  return !part.box && !part.layers && !part.ellipsoids;
}

}  // namespace esvr::esvr2vdb

int main(int argc, char** argv) {
  using namespace esvr::esvr2vdb;
  return esvr::cli::runMain(kProgram, [&] {
    if (const auto options = parseOptions(argc, argv)) run(*options);
    return 0;
  });
}
