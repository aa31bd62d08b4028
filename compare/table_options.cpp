#include "compare/table_options.h"

#include "cli/byte_size.h"
#include "cli/command_line.h"
#include "cli/number.h"
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
constexpr double kMaxPsnr = 200.0;  // dB, more than rounding to floats leaves

cli::ProgramText programText() {
  return {
      .name = std::string(kProgram) + " table",
      .purpose =
          "Compares .esvr files with other ways to store the volume: OpenVDB and NanoVDB files, "
          "lossless, quantised or reduced to the same size, and ZFP. All rows are measured on the "
          "same voxels, box and peak and timed in the same way. Each row names the command that "
          "makes only this row.",
      .usage =
          "  esvr-compare table REF.vdb [CAND.esvr ...] [--size 50KB]... [--external X]...\n"
          "  esvr-compare table REF.vdb --row SETTING",
      .notes =
          "The ratio is the size of the half-float Blosc VDB of the same grid divided by the size "
          "of the row. Times are medians of --runs runs after a warm-up run. Memory is the larger "
          "of what encoding and decoding allocate.\n"
          "\n"
          "Exit codes: 0 done, 1 failure or interrupted (finished rows are printed), 2 wrong "
          "options, 3 unusable input, 5 no such device or not enough memory (--max-memory).",
      .details =
          "For each CAND and each --size, the program searches for the best file of each baseline "
          "that is not larger. For VDB files, voxels near the background are dropped, empty leaves "
          "are removed, and the other voxels are quantised. The search varies the threshold until "
          "the file is at most 2 % smaller than the size, and takes the tolerance of FpN and the "
          "setting of ZFP with the highest PSNR. For the PSNR of each CAND and each "
          "--psnr, it searches for the smallest FpN and ZFP files. -v shows the searches, and "
          "--report includes them.\n"
          "\n"
          "--external-command takes any compressor of arrays. COMMAND is run in a shell as\n"
          "  COMMAND encode RAW PACKED NX NY NZ BOUND\n"
          "  COMMAND decode PACKED RAW NX NY NZ BOUND\n"
          "RAW has NX x NY x NZ float32 values (little-endian, x fastest). BOUND is an error in "
          "units of the values; the program searches for the largest one that suits. PACKED may "
          "have any form; its size is that of the row.\n"
          "\n"
          "Encoding goes from OpenVDB's tree (ZFP: from an array) to the file. Decoding goes from "
          "the file to OpenVDB's tree, NanoVDB's buffer, an array (ZFP) or a sparse volume "
          "(.esvr).",
      .examples =
          "  esvr-compare table smoke.vdb smoke.esvr\n"
          "  esvr-compare table smoke.vdb smoke.esvr --html page.html --markdown table.md\n"
          "  esvr-compare table ct.vdb ct.esvr --external SZ3=out.raw:48915:64x64x64:float32\n"
          "  esvr-compare table ct.vdb --size 50KB --external-command SZ3='compressors/sz3 "
          "bin/sz3'\n"
          "  esvr-compare table smoke.vdb --row nvdb-fpn-zip,tolerance=0.01,threshold=0.002"};
}

cli::CommandLine makeCommandLine() {
  cli::CommandLine line(programText());
  // clang-format off
  line.options().add_options()
    ("rows",
     value<std::string>()->value_name("KINDS")->default_value("lossless,quantised,matched,zfp"),
     "kinds of baselines, separated by commas, or none")
    ("row", value<Words>()->value_name("SETTING")->composing(),
     "use this baseline instead of --rows; the command of a row has its SETTING; may be repeated")
    ("size", value<Words>()->value_name("BYTES")->composing(),
     "also search for the best baselines of this size; may be repeated")
    ("psnr", value<std::vector<double>>()->value_name("DB")->composing(),
     "also search for the smallest baselines that reach this PSNR over the box; may be repeated")
    ("psnr-active", value<std::vector<double>>()->value_name("DB")->composing(),
     "also search for the smallest baselines that reach this PSNR over the active voxels, some of "
     "which may drop voxels near the background; may be repeated")
    ("fit", value<Words>()->value_name("BYTES")->composing(),
     "fit ellipsoids for a file of this size; --fit default fits with the default options, "
     "--fit paper by the paper's method; may be repeated")
    ("external", value<Words>()->value_name("X")->composing(),
     "add a row for the result of another system: NAME=FILE:BYTES, where FILE is a VDB file, or a "
     "raw file if :NXxNYxNZ:TYPE follows; then any of :encode=S, :decode=S, :fps=N; may be "
     "repeated")
    ("external-command", value<Words>()->value_name("X")->composing(),
     "add rows for a compressor that a command runs, at each size and PSNR: NAME=COMMAND; "
     "may be repeated")
    ("runs", value<int>()->value_name("N")->default_value(TableOptions{}.runs),
     "number of runs; times are their medians")
    ("images", value<int>()->value_name("N"),
     "draw pictures of each row from N views of a full turn, and compare them with the "
     "reference's")
    ("image-size", value<int>()->value_name("PX")->default_value(GalleryOptions{}.resolution.width),
     "width and height of a picture in pixels")
    ("image-step", value<double>()->value_name("S")->default_value(GalleryOptions{}.step),
     "distance between the samples of a ray in voxels, the same for every row")
    ("lpips", value<std::string>()->value_name("COMMAND"),
     "also report LPIPS as COMMAND computes it; COMMAND REFERENCE.png PICTURE.png must print the "
     "value last")
    ("colors", value<Words>()->value_name("MAP[:CURVE]")->composing(),
     "transfer function, with the names of esvr-render (default: viridis:linear); may be repeated")
    ("tf", value<Words>()->value_name("FILE")->composing(),
     "transfer function from a ParaView preset; may be repeated");
  // clang-format on
  addSceneOptions(line);
  addReportOptions(line.options());
  line.mainOptions({"rows", "size", "psnr", "psnr-active", "fit", "grid", "box", "images", "colors",
                    "runs", "device", "report", "markdown", "csv", "html", "force"});
  return line;
}

void readRows(const Arguments& a, TableOptions& options) {
  options.lossless = options.quantised = options.matched = options.zfp = false;
  for (const auto& word : cli::splitText(a.get<std::string>("rows"), ',')) {
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

std::vector<double> psnrs(const Arguments& a, const std::string& option) {
  const auto found = a.find<std::vector<double>>(option).value_or(std::vector<double>{});
  for (const double psnr : found) cli::requireRange(option, psnr, 0.0, kMaxPsnr);
  return found;
}

void readSizes(const Arguments& a, TableOptions& options) {
  for (const auto& text : a.find<Words>("size").value_or(Words{}))
    options.sizes.push_back(cli::parseByteSize("size", text));
  options.psnrs = psnrs(a, "psnr");
  options.activePsnrs = psnrs(a, "psnr-active");
  for (const auto& text : a.find<Words>("fit").value_or(Words{})) {
    if (text == "default")
      options.fitDefault = true;
    else if (text == "paper")
      options.fitPaper = true;
    else
      options.fits.push_back(cli::parseByteSize("fit", text));
  }
}

/// \pre the candidates and the sizes were read
void readCommands(const Arguments& a, TableOptions& options) {
  for (const auto& text : a.find<Words>("external-command").value_or(Words{}))
    options.commands.push_back(parseExternalCommand(text));
  const bool hasAim = !options.candidates.empty() || !options.sizes.empty() ||
                      !options.psnrs.empty() || !options.activePsnrs.empty() ||
                      !options.fits.empty() || options.fitDefault || options.fitPaper;
  if (!options.commands.empty() && !hasAim)
    throw UsageError(
        "--external-command needs a size or a PSNR to match: CAND, --size, --psnr, --psnr-active "
        "or "
        "--fit");
}

/// Reads a text like "viridis" or "viridis:tent".
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
      throw UsageError("--colors, --tf and --lpips need --images");
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

std::vector<std::filesystem::path> inputsOf(const TableOptions& options) {
  std::vector<std::filesystem::path> inputs = options.inputs.paths;
  for (const auto& external : options.externals) inputs.push_back(external.file);
  return inputs;
}

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
  readCommands(a, options);
  options.runs = a.get<int>("runs");
  cli::requireRange("runs", options.runs, 1, kMaxRuns);
  readImages(a, options);
  options.files = reportFiles(a);
  options.commandLine = commandLine(argc, argv);
  return options;
}

}  // namespace esvr::compare
