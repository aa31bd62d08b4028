#include "compare/curves_options.h"

#include <limits>

#include "cli/box_option.h"
#include "cli/byte_size.h"
#include "cli/command_line.h"
#include "compare/program.h"
#include "esvr/error.h"

namespace esvr::compare {
namespace {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;
using Words = std::vector<std::string>;

constexpr int kMostPixels = 4096;

cli::ProgramText programText() {
  return {
      .name = std::string(kProgram) + " curves",
      .purpose =
          "Draws error over run time, error over bytes and pictures a second over bytes, of\n"
          ".esvr files and of VDB and ZFP files of the same sizes.",
      .usage = "  esvr-compare curves REF.vdb [CAND.esvr ...] --output PREFIX [--fit BYTES]...",
      .notes =
          "Writes PREFIX.csv and PREFIX.json with every point, and PREFIX-seconds, -bytes and,\n"
          "with --fps, -fps as .svg and .png.\n"
          "\n"
          "Without CAND and --fit, ellipsoids are fitted here to six sizes: the half-float Blosc\n"
          "VDB's over 10, 20, 50, 100, 200 and 400. Seconds are those of the optimisation, which\n"
          "an .esvr may hold itself; of fits made here also end to end, from voxels to file.\n"
          "\n"
          "Exit codes: 0 done, 1 failure or interrupted (points already made are written), 2\n"
          "wrong options, 3 input that cannot be used, 5 memory.",
      .examples =
          "  esvr-compare curves smoke.vdb --output smoke\n"
          "  esvr-compare curves smoke.vdb 20k.esvr 40k.esvr 80k.esvr --output smoke --fps 400"};
}

cli::CommandLine makeCommandLine() {
  cli::CommandLine line(programText());
  line.argument("reference", "REF.vdb");
  line.repeatedArgument("candidates");
  // clang-format off
  line.options().add_options()
    ("output,o", value<std::string>()->value_name("PREFIX"), "of the files to write")
    ("grid,g", value<std::string>()->value_name("NAME"),
     "the grid to compare, in every file (default: the first with voxels)")
    ("fit", value<Words>()->value_name("BYTES")->composing(),
     "fit ellipsoids to this size, here; may be repeated")
    ("no-baselines", bool_switch(), "no VDB and ZFP files of the same sizes")
    ("fps", value<int>()->value_name("PX"), "draw a picture of so many pixels a side, and time it")
    ("max-dense", value<std::string>()->value_name("BYTES")->default_value("1GB"),
     "skip ZFP where the box as an array of floats takes more")
    ("box", value<std::string>()->value_name("BOX"),
     "x0,y0,z0,x1,y1,z1 of the PSNR (default: the reference's active bounding box)")
    ("peak", value<double>()->value_name("P"), "of the PSNR (default: the reference's largest value)")
    ("device", value<std::string>()->value_name("D")->default_value("auto"),
     "of the fits: auto, cpu, cuda or cuda:N")
    ("force,f", bool_switch(), "replace files that exist");
  // clang-format on
  return line;
}

void readImages(const Arguments& a, TableOptions& options) {
  const auto side = a.find<int>("fps");
  if (!side) return;
  cli::requireRange("fps", *side, 1, kMostPixels);
  options.images.views = 3;  // of which the median counts
  options.images.resolution = {*side, *side};
  options.images.transfers = {
      {"viridis:linear", {builtInColorMap("viridis"), builtInOpacity("linear")}}};
}

TableOptions tableOptions(const Arguments& a) {
  TableOptions options;
  options.reference = a.get<std::string>("reference");
  for (const auto& candidate : a.find<Words>("candidates").value_or(Words{}))
    options.candidates.emplace_back(candidate);
  options.grid = a.find<std::string>("grid");
  options.matched = options.zfp = !a.get<bool>("no-baselines");
  for (const auto& text : a.find<Words>("fit").value_or(Words{}))
    options.fits.push_back(cli::parseByteSize("fit", text));
  options.runs = 1;
  options.maxDense = cli::parseByteSize("max-dense", a.get<std::string>("max-dense"));
  if (const auto box = a.find<std::string>("box")) options.box = cli::parseBox(*box);
  options.peak = a.find<double>("peak");
  if (options.peak)
    cli::requireRange("peak", *options.peak, std::numeric_limits<double>::min(),
                      std::numeric_limits<double>::max());
  options.device = a.get<std::string>("device");
  readImages(a, options);
  options.threads = a.threads;
  options.verbosity = a.verbosity;
  return options;
}

}  // namespace

std::optional<CurvesOptions> parseCurvesOptions(int argc, const char* const* argv) {
  const auto arguments = makeCommandLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  CurvesOptions options;
  options.table = tableOptions(*arguments);
  options.table.commandLine = commandLine(argc, argv);
  const auto prefix = arguments->find<std::string>("output");
  if (!prefix || prefix->empty()) throw UsageError("missing --output PREFIX");
  options.prefix = *prefix;
  options.overwrite = arguments->get<bool>("force");
  return options;
}

}  // namespace esvr::compare
