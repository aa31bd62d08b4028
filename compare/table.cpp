// The command `table` and its options.

#include "compare/table.h"

#include <algorithm>
#include <iostream>

#include "esvr/error.h"
#include "programs/command_line.h"
#include "programs/files.h"
#include "programs/option_values.h"

namespace esvr::compare {

using cli::po::bool_switch;
using cli::po::value;

// Options.

namespace {

using Words = std::vector<std::string>;

/// The options and arguments for the reference and the candidates.
void addSceneOptions(cli::CommandLine& line) {
  line.argument("reference", "REF.vdb");
  line.repeatedArgument("candidates");
  line.volumeInputs({"reference", "candidates"});
  line.textInputs({"tf"});
  line.options().add_options()(
      "grid,g", value<std::string>()->value_name("NAME"),
      "grid to compare, in every file (default: the first grid with active voxels)");
  addMeasureOptions(line.options());
  // clang-format off
  line.options().add_options()
    ("max-dense", value<std::string>()->value_name("BYTES")->default_value("1GB"),
     "leave ZFP out if the box as an array of floats takes more than this");
  // clang-format on
  cli::addDevice(line.options(), "device for fits and pictures: ");
  cli::addHostMemory(line);
}

/// Adds --report and the other forms of a report.
void addReportOptions(cli::po::options_description& options) {
  addJsonReport(options);
  // clang-format off
  options.add_options()
    ("markdown", value<std::string>()->value_name("FILE.md"), "write the tables as Markdown")
    ("csv", value<std::string>()->value_name("FILE.csv"),
     "write the figures with all digits as CSV")
    ("html", value<std::string>()->value_name("FILE.html"), "write a self-contained HTML page")
    ("force,f", bool_switch(), "replace reports that exist");
  // clang-format on
}

ReportFiles reportFiles(const cli::Arguments& a) {
  const auto path = [&](const char* option) { return a.find<std::string>(option).value_or(""); };
  return {path("report"), path("markdown"), path("csv"), path("html"), a.get<bool>("force")};
}

/// Checks before the work that the files can be written.
/// \throws UsageError, RuntimeFailure  a file cannot be written
void checkReportFiles(const ReportFiles& files, const std::vector<std::filesystem::path>& inputs) {
  cli::requireSeparate(inputs, {files.json, files.markdown, files.csv, files.html});
  const auto check = [&](const std::string& file, const char* extension) {
    if (file.empty() || file == cli::kStandardOutput) return;
    cli::checkOutput(file, {extension}, files.overwrite);
  };
  check(files.json, ".json");
  check(files.markdown, ".md");
  check(files.csv, ".csv");
  check(files.html, ".html");
}

void readSceneOptions(const cli::Arguments& a, TableOptions& options) {
  options.inputs = a.inputs;
  options.reference = a.get<std::string>("reference");
  for (const auto& candidate : a.all("candidates")) options.candidates.emplace_back(candidate);
  options.grid = a.find<std::string>("grid");
  options.box = boxOption(a);
  options.peak = peakOption(a);
  options.maxDense = cli::parseByteSize("max-dense", a.get<std::string>("max-dense"));
  options.device = cli::deviceOf(a);
  options.memory = cli::hostMemoryOf(a);
  options.threads = a.threads;
  options.verbosity = a.verbosity;
}

constexpr int kMaxRuns = 1000;
constexpr double kMaxPsnr = 200.0;  // dB, more than rounding to floats leaves

cli::ProgramText tableText() {
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

cli::CommandLine tableLine() {
  cli::CommandLine line(tableText());
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
     "draw pictures of each row from N views of a full turn, and compare them with the reference's")
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

void readRows(const cli::Arguments& a, TableOptions& options) {
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
      cli::refuseWord("rows", word, {"lossless", "quantised", "matched", "zfp", "none"});
  }
  for (const auto& text : a.all("row")) options.settings.push_back(parseBaseline(text));
}

std::vector<double> psnrs(const cli::Arguments& a, const std::string& option) {
  const auto found = a.all<double>(option);
  for (const double psnr : found) cli::requireRange(option, psnr, 0.0, kMaxPsnr);
  return found;
}

void readSizes(const cli::Arguments& a, TableOptions& options) {
  for (const auto& text : a.all("size")) options.sizes.push_back(cli::parseByteSize("size", text));
  options.psnrs = psnrs(a, "psnr");
  options.activePsnrs = psnrs(a, "psnr-active");
  for (const auto& text : a.all("fit")) {
    if (text == "default")
      options.fitDefault = true;
    else if (text == "paper")
      options.fitPaper = true;
    else
      options.fits.push_back(cli::parseByteSize("fit", text));
  }
}

/// \pre the candidates and the sizes were read
void readCommands(const cli::Arguments& a, TableOptions& options) {
  for (const auto& text : a.all("external-command"))
    options.commands.push_back(parseExternalCommand(text));
  const bool hasAim = !options.candidates.empty() || !options.sizes.empty() ||
                      !options.psnrs.empty() || !options.activePsnrs.empty() ||
                      !options.fits.empty() || options.fitDefault || options.fitPaper;
  if (!options.commands.empty() && !hasAim)
    throw UsageError(
        "--external-command needs a size or a PSNR to match: CAND, --size, --psnr, --psnr-active "
        "or --fit");
}

/// Reads a text like "viridis" or "viridis:tent".
NamedTransfer builtInTransfer(const std::string& text) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string curve = colon < text.size() ? text.substr(colon + 1) : "linear";
  return {text, {builtInColorMap(text.substr(0, colon)), builtInOpacity(curve)}};
}

void readImages(const cli::Arguments& a, TableOptions& options) {
  constexpr int kMaxViews = 360, kMaxPixels = 4096;
  constexpr double kMinStep = 1e-3, kMaxStep = 1e3;
  GalleryOptions& images = options.images;
  for (const auto& text : a.all("colors")) images.transfers.push_back(builtInTransfer(text));
  for (const auto& file : a.all("tf")) images.transfers.push_back({file, readParaViewPreset(file)});
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

/// All files that a run reads.
std::vector<std::filesystem::path> inputsOf(const TableOptions& options) {
  std::vector<std::filesystem::path> inputs = options.inputs.paths;
  for (const auto& external : options.externals) inputs.push_back(external.file);
  return inputs;
}

}  // namespace

std::optional<TableOptions> parseTableOptions(int argc, const char* const* argv) {
  const auto arguments = tableLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const cli::Arguments& a = *arguments;
  TableOptions options;
  readSceneOptions(a, options);
  readRows(a, options);
  readSizes(a, options);
  for (const auto& text : a.all("external")) options.externals.push_back(parseExternal(text));
  readCommands(a, options);
  options.runs = a.get<int>("runs");
  cli::requireRange("runs", options.runs, 1, kMaxRuns);
  readImages(a, options);
  options.files = reportFiles(a);
  options.commandLine = commandLine(argc, argv);
  return options;
}

void table(const TableOptions& options) {
  const cli::ThreadLimit threads(options.threads);
  const cli::Interrupts interrupts;
  const cli::Log log(kProgram, options.verbosity);
  checkReportFiles(options.files, inputsOf(options));
  const TableRecord record = makeRows(options, interrupts.token(), log);
  const Completion completion;  // finished rows are written after an interruption, too
  writeReports(options, record);
  if (options.files.json != cli::kStandardOutput && options.verbosity != cli::Verbosity::kQuiet)
    printTable(record, options.verbosity == cli::Verbosity::kVerbose, std::cout);
  if (record.interrupted)
    throw RuntimeFailure("interrupted; " + cli::counted(record.rows.size(), "row") +
                         " made, the others are missing");
}

}  // namespace esvr::compare
