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
          "Plots error over run time, error over bytes and pictures per second over bytes, for "
          ".esvr files and for VDB and ZFP files of the same sizes.",
      .usage = "  esvr-compare curves REF.vdb [CAND.esvr ...] --output PREFIX [--fit BYTES]...",
      .notes =
          "The program writes every point to PREFIX.csv and PREFIX.json. The page PREFIX.html "
          "has the charts: error over bytes, error over run time if this run makes fits, and "
          "pictures per second over bytes with --fps.\n"
          "\n"
          "Without CAND and --fit, the program fits ellipsoids for six sizes: the size of the "
          "half-float Blosc VDB divided by 10, 20, 50, 100, 200 and 400. The chart over run time "
          "has the "
          "time of the optimisation, and the whole time from the voxels to the file.\n"
          "\n"
          "Exit codes: 0 done, 1 failure or interrupted (finished points are written), 2 wrong "
          "options, 3 unusable input, 5 no such device or not enough memory (--max-memory).",
      .examples =
          "  esvr-compare curves smoke.vdb --output curves\n"
          "  esvr-compare curves smoke.vdb 20k.esvr 40k.esvr 80k.esvr --output sizes --fps 400"};
}

cli::CommandLine makeCommandLine() {
  cli::CommandLine line(programText());
  // clang-format off
  line.options().add_options()
    ("output,o", value<std::string>()->value_name("PREFIX"),
     "prefix of the names of the written files")
    ("fit", value<Words>()->value_name("BYTES")->composing(),
     "fit ellipsoids for a file of this size; may be repeated")
    ("no-baselines", bool_switch(), "do not compare with VDB and ZFP files of the same sizes")
    ("fps", value<int>()->value_name("PX"),
     "measure the speed of drawing pictures of PX x PX pixels")
    ("force,f", bool_switch(), "replace files that exist");
  // clang-format on
  addSceneOptions(line);
  return line;
}

void readImages(const Arguments& a, TableOptions& options) {
  const auto side = a.find<int>("fps");
  if (!side) return;
  cli::requireRange("fps", *side, 1, kMaxPixels);
  options.images.views = 3;  // the median time counts
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
