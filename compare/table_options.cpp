#include "compare/table_options.h"

#include "cli/byte_size.h"
#include "cli/command_line.h"
#include "compare/program.h"
#include "compare/report_options.h"
#include "compare/scene_options.h"
#include "esvr/error.h"

namespace esvr::compare {
namespace {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;
using Words = std::vector<std::string>;

constexpr int kMaxRuns = 1000;

cli::ProgramText programText() {
  return {
      .name = std::string(kProgram) + " table",
      .purpose =
          "Compares .esvr files with what else could hold the volume: OpenVDB and NanoVDB files,\n"
          "lossless, quantised, and cut to the same size, and ZFP. Every row is of the same\n"
          "voxels, box and peak, is timed alike, and has the command that makes it alone.",
      .usage =
          "  esvr-compare table REF.vdb [CAND.esvr ...] [--size 50KB]... [--external X]...\n"
          "  esvr-compare table REF.vdb --row SETTING",
      .notes =
          "Sizes are matched to each CAND and each --size: the best file that is not larger. For\n"
          "VDB files voxels near the background are dropped, empty leaves pruned and the rest\n"
          "quantised; the threshold is searched until the bytes are within 2 %, FpN's tolerance\n"
          "and ZFP's settings for the highest PSNR. -v shows the search, --report has all of it.\n"
          "PSNR is matched with FpN's tolerance and ZFP's settings.\n"
          "\n"
          "The ratio is to the half-float Blosc VDB of the same grid. Seconds to encode and "
          "decode\n"
          "are medians of --runs after one that warms up, between memory and file: the grid in\n"
          "OpenVDB's tree to the file, and the file to OpenVDB's tree, NanoVDB's buffer, an array\n"
          "(ZFP) or a sparse volume (.esvr). Memory is what the slower of the two adds.\n"
          "\n"
          "Exit codes: 0 done, 1 failure or interrupted (rows already made are printed), 2 wrong\n"
          "options, 3 input that cannot be used, 5 memory.",
      .examples =
          "  esvr-compare table smoke.vdb smoke.esvr\n"
          "  esvr-compare table smoke.vdb smoke.esvr --html page.html --markdown table.md\n"
          "  esvr-compare table ct.vdb ct.esvr --external SZ3=out.raw:48915:256x256x256:float32\n"
          "  esvr-compare table smoke.vdb --row nvdb-fpn-zip,tolerance=0.01,threshold=0.002"};
}

cli::CommandLine makeCommandLine() {
  cli::CommandLine line(programText());
  // clang-format off
  line.options().add_options()
    ("rows", value<std::string>()->value_name("KINDS")->default_value("lossless,quantised,matched,zfp"),
     "which baselines, separated by commas")
    ("row", value<Words>()->value_name("SETTING")->composing(),
     "this baseline instead, as a row's command names it; may be repeated")
    ("size", value<Words>()->value_name("BYTES")->composing(),
     "match this size too; may be repeated")
    ("fit", value<Words>()->value_name("BYTES")->composing(),
     "fit ellipsoids to this size, here; --fit default takes what size the defaults give, --fit paper "
     "the paper's method; may be repeated")
    ("external", value<Words>()->value_name("X")->composing(),
     "a row for another system's result: NAME=FILE:BYTES, FILE a VDB, or raw with :NXxNYxNZ:TYPE; "
     "and any of :encode=S, :decode=S, :fps=N; may be repeated")
    ("runs", value<int>()->value_name("N")->default_value(TableOptions{}.runs),
     "of which times are medians")
    ("images", value<int>()->value_name("N"),
     "pictures of each row from N views of a full turn, and how far they are from the reference's")
    ("image-size", value<int>()->value_name("PX")->default_value(GalleryOptions{}.resolution.width),
     "of a picture's side")
    ("image-step", value<double>()->value_name("S")->default_value(GalleryOptions{}.step),
     "voxels between samples, the same for every row")
    ("lpips", value<std::string>()->value_name("COMMAND"),
     "LPIPS too, by a program of yours: COMMAND REFERENCE.png PICTURE.png prints it last")
    ("colors", value<Words>()->value_name("MAP[:CURVE]")->composing(),
     "a transfer function, as esvr-render names them (default: viridis:linear); may be repeated")
    ("tf", value<Words>()->value_name("FILE")->composing(),
     "a transfer function from a ParaView preset; may be repeated");
  // clang-format on
  addSceneOptions(line);
  addReportOptions(line.options());
  return line;
}

void readRows(const Arguments& a, TableOptions& options) {
  options.lossless = options.quantised = options.matched = options.zfp = false;
  for (const auto& word : splitAtCommas(a.get<std::string>("rows"))) {
    if (word == "lossless")
      options.lossless = true;
    else if (word == "quantised")
      options.quantised = true;
    else if (word == "matched")
      options.matched = true;
    else if (word == "zfp")
      options.zfp = true;
    else if (word != "none")
      throw UsageError("--rows takes lossless, quantised, matched, zfp or none, not '" + word +
                       "'");
  }
  for (const auto& text : a.find<Words>("row").value_or(Words{}))
    options.settings.push_back(parseBaseline(text));
}

void readSizes(const Arguments& a, TableOptions& options) {
  for (const auto& text : a.find<Words>("size").value_or(Words{}))
    options.sizes.push_back(cli::parseByteSize("size", text));
  for (const auto& text : a.find<Words>("fit").value_or(Words{})) {
    if (text == "default")
      options.fitDefault = true;
    else if (text == "paper")
      options.fitPaper = true;
    else
      options.fits.push_back(cli::parseByteSize("fit", text));
  }
}

/// "viridis" or "viridis:tent".
NamedTransfer builtInTransfer(const std::string& text) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string curve = colon < text.size() ? text.substr(colon + 1) : "linear";
  return {text, {builtInColorMap(text.substr(0, colon)), builtInOpacity(curve)}};
}

void readImages(const Arguments& a, TableOptions& options) {
  constexpr int kMaxViews = 360, kMaxPixels = 4096;
  constexpr double kMinStep = 1e-3, kMaxStep = 1e3;
  GalleryOptions& images = options.images;
  for (const auto& text : a.find<Words>("colors").value_or(Words{}))
    images.transfers.push_back(builtInTransfer(text));
  for (const auto& file : a.find<Words>("tf").value_or(Words{}))
    images.transfers.push_back({file, readParaViewPreset(file)});
  images.lpips = a.find<std::string>("lpips").value_or("");
  if (!a.has("images")) {
    if (!images.transfers.empty() || !images.lpips.empty())
      throw UsageError("--colors, --tf and --lpips say nothing without --images");
    return;
  }
  images.views = a.get<int>("images");
  cli::requireRange("images", images.views, 1, kMaxViews);
  const int side = a.get<int>("image-size");
  cli::requireRange("image-size", side, 1, kMaxPixels);
  images.resolution = {side, side};
  images.step = a.get<double>("image-step");
  cli::requireRange("image-step", images.step, kMinStep, kMaxStep);
  if (images.transfers.empty()) images.transfers.push_back(builtInTransfer("viridis:linear"));
}

}  // namespace

std::optional<TableOptions> parseTableOptions(int argc, const char* const* argv) {
  const auto arguments = makeCommandLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const Arguments& a = *arguments;
  TableOptions options;
  readSceneOptions(a, options);
  readRows(a, options);
  readSizes(a, options);
  for (const auto& text : a.find<Words>("external").value_or(Words{}))
    options.externals.push_back(parseExternal(text));
  options.runs = a.get<int>("runs");
  cli::requireRange("runs", options.runs, 1, kMaxRuns);
  readImages(a, options);
  options.files = reportFiles(a);
  options.commandLine = commandLine(argc, argv);
  return options;
}

}  // namespace esvr::compare
