#include "compare/curves_options.h"

#include "cli/byte_size.h"
#include "cli/command_line.h"
#include "compare/program.h"
#include "compare/scene_options.h"
#include "esvr/error.h"

namespace esvr::compare {
namespace {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;
using Words = std::vector<std::string>;

constexpr int kMaxPixels = 4096;

cli::ProgramText programText() {
  return {
      .name = std::string(kProgram) + " curves",
      .purpose =
          "Draws error over run time, error over bytes and pictures a second over bytes, of\n"
          ".esvr files and of VDB and ZFP files of the same sizes.",
      .usage = "  esvr-compare curves REF.vdb [CAND.esvr ...] --output PREFIX [--fit BYTES]...",
      .notes =
          "Writes PREFIX.csv and PREFIX.json with every point, PREFIX-seconds, -bytes and, with\n"
          "--fps, -fps as .svg and .png, and PREFIX.html with all of it.\n"
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
  // clang-format off
  line.options().add_options()
    ("output,o", value<std::string>()->value_name("PREFIX"), "of the files to write")
    ("fit", value<Words>()->value_name("BYTES")->composing(),
     "fit ellipsoids to this size, here; may be repeated")
    ("no-baselines", bool_switch(), "no VDB and ZFP files of the same sizes")
    ("fps", value<int>()->value_name("PX"), "draw a picture of so many pixels a side, and time it")
    ("force,f", bool_switch(), "replace files that exist");
  // clang-format on
  addSceneOptions(line);
  return line;
}

void readImages(const Arguments& a, TableOptions& options) {
  const auto side = a.find<int>("fps");
  if (!side) return;
  cli::requireRange("fps", *side, 1, kMaxPixels);
  options.images.views = 3;  // of which the median counts
  options.images.resolution = {*side, *side};
  options.images.transfers = {
      {"viridis:linear", {builtInColorMap("viridis"), builtInOpacity("linear")}}};
}

TableOptions tableOptions(const Arguments& a) {
  TableOptions options;
  readSceneOptions(a, options);
  options.matched = options.zfp = !a.get<bool>("no-baselines");
  for (const auto& text : a.find<Words>("fit").value_or(Words{}))
    options.fits.push_back(cli::parseByteSize("fit", text));
  options.runs = 1;
  readImages(a, options);
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
