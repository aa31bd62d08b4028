#include "compare/check_options.h"

#include "cli/byte_size.h"
#include "cli/choice.h"
#include "cli/command_line.h"
#include "cli/host_memory.h"
#include "cli/number.h"
#include "compare/measure_options.h"
#include "compare/program.h"
#include "compare/report_options.h"
#include "esvr/error.h"

namespace esvr::compare {
namespace {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;

cli::ProgramText programText() {
  return {
      .name = std::string(kProgram) + " check",
      .purpose =
          "Compares the grids of a file with the grids of the same names in a reference file, and "
          "fails if a grid exceeds the given limits.",
      .usage =
          "  esvr-compare check REF CAND [--min-psnr DB] [--max-error E] [--max-bytes SIZE] ...\n"
          "  esvr-compare check REF CAND --baseline FILE.json [--update]",
      .notes =
          "REF and CAND may each be a .vdb, .nvdb or .esvr file, - for standard input, or a pipe. "
          "Grids are compared and not the "
          "bytes of files, because the bytes of a .vdb file differ whenever it is written. Voxels "
          "are compared in index space. Different transforms, names, classes, value types, "
          "backgrounds and metadata are listed, and the check fails if --fail-on names them. It "
          "always fails if only one of the files has a grid, if a grid has become one of another "
          "type, or if the bounding boxes of the active voxels of the two grids do not intersect. "
          "Grids that are not of floats or doubles, and grids of the same bytes, are compared bit "
          "for bit. --ignore-grids "
          "excludes a grid from all of this.\n"
          "\n"
          "REF and CAND may both be sequences: a pattern such as smoke.####.vdb, or an .esvr file "
          "that holds a sequence. Each frame is compared, and 'temporal' is the PSNR of the change "
          "from the frame before it. A frame that only one of them has makes the check fail.\n"
          "\n"
          "A baseline holds figures and their tolerances. --update writes the figures of this run "
          "and keeps the tolerances of the file.\n"
          "\n"
          "Exit codes: 0 within all limits, 1 failure, 2 wrong options, 3 unusable input or a grid "
          "that cannot be compared, 4 a "
          "limit was missed, 5 not enough memory (--max-memory).",
      .examples =
          "  esvr-compare check smoke.vdb smoke.esvr --min-psnr 45 --min-iou 0.98\n"
          "  esvr-compare check smoke.vdb back.vdb --max-error 1% --fail-on transform,metadata\n"
          "  esvr-compare check ref.vdb new.vdb -g density=smoke --max-bytes 200KB\n"
          "  esvr-compare check smoke.vdb smoke.esvr --baseline smoke.json --update\n"
          "  esvr-compare check 'smoke.####.vdb' smoke.esvr --min-psnr-temporal 45"};
}

cli::CommandLine makeCommandLine() {
  cli::CommandLine line(programText());
  line.argument("reference", "REF");
  line.argument("candidate", "CAND");
  line.volumeInputs({"reference", "candidate"});
  line.textInputs({"baseline"});
  auto& options = line.options();
  options.add_options()(
      "grid,g", value<std::vector<std::string>>()->value_name("NAME")->composing(),
      "compare this grid only; may be repeated; NAME=OTHER if its name in CAND is OTHER");
  options.add_options()(
      "ignore-grids", value<std::vector<std::string>>()->value_name("NAME")->composing(),
      "do not compare this grid: it may be missing in either file, or be of another type; may be "
      "repeated");
  for (const Figure& figure : allFigures())
    options.add_options()(figure.option, value<std::string>()->value_name("X"), figure.unit);
  // clang-format off
  options.add_options()
    ("frames", value<std::string>()->value_name("RANGE"),
     "of sequences: the frames to compare, for example 1-100x2 (default: all)")
    ("max-bytes", value<std::string>()->value_name("SIZE"),
     "largest size of the file CAND, for example 200KB")
    ("fail-on", value<std::string>()->value_name("KINDS"),
     "differences for which the check fails, separated by commas: name, class, type, "
     "background, transform, metadata, inactive (values of inactive voxels), or all")
    ("ssim", bool_switch(), "measure and print the SSIM even without a limit on it")
    ("baseline", value<std::string>()->value_name("FILE.json"),
     "compare with the figures of this file")
    ("update", bool_switch(), "write the figures of this run to the file of --baseline instead");
  // clang-format on
  addMeasureOptions(options);
  addJsonReport(options);
  options.add_options()("force,f", bool_switch(), "replace the report if it exists");
  cli::addHostMemory(line);
  return line;
}

std::set<DifferenceKind> kindsOf(const std::string& word) {
  using Kind = DifferenceKind;
  if (word == "all")
    return {Kind::kName,      Kind::kClass,    Kind::kValueType, Kind::kBackground,
            Kind::kTransform, Kind::kMetadata, Kind::kInactive};
  return {cli::choose<Kind>("fail-on", word,
                            {{"name", Kind::kName},
                             {"class", Kind::kClass},
                             {"type", Kind::kValueType},
                             {"background", Kind::kBackground},
                             {"transform", Kind::kTransform},
                             {"metadata", Kind::kMetadata},
                             {"inactive", Kind::kInactive}})};
}

std::set<DifferenceKind> parseKinds(const std::string& list) {
  std::set<DifferenceKind> kinds;
  for (const auto& word : cli::splitText(list, ',')) kinds.merge(kindsOf(word));
  return kinds;
}

/// Reads a limit. Limits on errors in value units must be positive or 0; others are any number.
cli::ErrorBound limitOf(const Figure& figure, const std::string& text) {
  if (figure.inValueUnits && text != "0") return cli::parseErrorBound(figure.option, text);
  const auto amount = cli::parseNumber(text);
  if (!amount)
    throw UsageError("--" + std::string(figure.option) + " must be a number, not '" + text + "'");
  return {.amount = *amount};
}

void readLimits(const Arguments& a, CheckOptions& options) {
  for (const Figure& figure : allFigures())
    if (const auto text = a.find<std::string>(figure.option))
      options.limits[std::size_t(figure.id)] = limitOf(figure, *text);
  if (const auto size = a.find<std::string>("max-bytes"))
    options.maxBytes = cli::parseByteSize("max-bytes", *size);
  if (const auto kinds = a.find<std::string>("fail-on")) options.failOn = parseKinds(*kinds);
}

}  // namespace

std::optional<CheckOptions> parseCheckOptions(int argc, const char* const* argv) {
  const auto arguments = makeCommandLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const Arguments& a = *arguments;
  CheckOptions options;
  options.inputs = a.inputs;
  options.reference = a.get<std::string>("reference");
  options.candidate = a.get<std::string>("candidate");
  options.grids = a.find<std::vector<std::string>>("grid").value_or(std::vector<std::string>{});
  if (const auto names = a.find<std::vector<std::string>>("ignore-grids"))
    options.ignored = {names->begin(), names->end()};
  readLimits(a, options);
  if (const auto range = a.find<std::string>("frames"))
    options.frames = cli::parseFrames("frames", *range);
  options.baseline = a.find<std::string>("baseline");
  options.update = a.get<bool>("update");
  if (options.update && !options.baseline) throw UsageError("--update needs --baseline FILE.json");
  options.box = boxOption(a);
  options.peak = peakOption(a);
  options.ssim = a.get<bool>("ssim");
  options.report = a.find<std::string>("report").value_or("");
  options.overwrite = a.get<bool>("force");
  options.memory = cli::hostMemoryOf(a);
  options.threads = a.threads;
  options.verbosity = a.verbosity;
  options.commandLine = commandLine(argc, argv);
  return options;
}

}  // namespace esvr::compare
