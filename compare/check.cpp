// The command `check`: its options, the comparison of two files or of two sequences, and the
// results as text and as JSON.

#include "compare/check.h"

#include <algorithm>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "esvr/error.h"
#include "programs/command_line.h"
#include "programs/files.h"

namespace esvr::compare {

// Options.

namespace {

/// The kinds of differences, as --fail-on and the report name them.
constexpr std::initializer_list<cli::Choice<DifferenceKind>> kDifferenceNames{
    {"name", DifferenceKind::kName},           {"class", DifferenceKind::kClass},
    {"type", DifferenceKind::kValueType},      {"background", DifferenceKind::kBackground},
    {"transform", DifferenceKind::kTransform}, {"metadata", DifferenceKind::kMetadata},
    {"inactive", DifferenceKind::kInactive}};

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;

cli::ProgramText checkText() {
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
          "Grids are compared and not the bytes of files, because the bytes of a .vdb file differ "
          "whenever it is written. Voxels are compared in index space. Different transforms, "
          "names, classes, value types, backgrounds and metadata are listed, and the check fails "
          "if --fail-on names them. It always fails if only one of the files has a grid, if a grid "
          "has become one of another type, or if the bounding boxes of the active voxels of the "
          "two grids do not intersect. Grids that are not of floats or doubles, and grids of the "
          "same bytes, are compared bit for bit. --ignore-grids excludes a grid from all of this.\n"
          "\n"
          "REF and CAND may both be sequences: a pattern such as smoke.####.vdb, or an .esvr file "
          "that holds a sequence. Each frame is compared, and 'temporal' is the PSNR of the change "
          "from the frame before it. A frame that only one of them has makes the check fail.\n"
          "\n"
          "A baseline holds figures and their tolerances. --update writes the figures of this run "
          "and keeps the tolerances of the file.\n"
          "\n"
          "Exit codes: 0 within all limits, 1 failure, 2 wrong options, 3 unusable input or a grid "
          "that cannot be compared, 4 a limit was missed, 5 not enough memory (--max-memory).",
      .examples =
          "  esvr-compare check smoke.vdb smoke.esvr --min-psnr 45 --min-iou 0.98\n"
          "  esvr-compare check smoke.vdb back.vdb --max-error 1% --fail-on transform,metadata\n"
          "  esvr-compare check ref.vdb new.vdb -g density=smoke --max-bytes 200KB\n"
          "  esvr-compare check smoke.vdb smoke.esvr --baseline smoke.json --update\n"
          "  esvr-compare check 'smoke.####.vdb' smoke.esvr --min-psnr-temporal 45"};
}

cli::CommandLine checkLine() {
  cli::CommandLine line(checkText());
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

std::set<DifferenceKind> parseKinds(const std::string& list) {
  std::set<DifferenceKind> kinds;
  for (const auto& word : cli::splitText(list, ','))
    if (word == "all")
      for (const auto& [name, kind] : kDifferenceNames) kinds.insert(kind);
    else
      kinds.insert(cli::choose<DifferenceKind>("fail-on", word, kDifferenceNames));
  return kinds;
}

/// Reads a limit. Limits on errors in value units must be positive or 0; others are any number.
cli::ErrorBound limitOf(const Figure& figure, const std::string& text, CheckOptions& options) {
  if (figure.id == FigureId::kRelativeError) {
    const cli::RelativeBound bound = cli::parseRelativeBound(figure.option, text);
    options.relativeFloor = bound.floor;
    return {.amount = bound.share};
  }
  if (figure.inValueUnits && text != "0") return cli::parseErrorBound(figure.option, text);
  const auto amount = cli::parseNumber(text);
  if (!amount)
    throw UsageError("--" + std::string(figure.option) + " must be a number, not '" + text + "'");
  return {.amount = *amount};
}

void readLimits(const Arguments& a, CheckOptions& options) {
  for (const Figure& figure : allFigures())
    if (const auto text = a.find<std::string>(figure.option))
      options.limits[std::size_t(figure.id)] = limitOf(figure, *text, options);
  if (const auto size = a.find<std::string>("max-bytes"))
    options.maxBytes = cli::parseByteSize("max-bytes", *size);
  if (const auto kinds = a.find<std::string>("fail-on")) options.failOn = parseKinds(*kinds);
}

}  // namespace

std::optional<CheckOptions> parseCheckOptions(int argc, const char* const* argv) {
  const auto arguments = checkLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const Arguments& a = *arguments;
  CheckOptions options;
  options.inputs = a.inputs;
  options.reference = a.get<std::string>("reference");
  options.candidate = a.get<std::string>("candidate");
  options.grids = a.all("grid");
  for (const std::string& name : a.all("ignore-grids")) options.ignored.insert(name);
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

// Sequences.

namespace {

using cli::FrameNumber;

/// The sequences that are compared; null for a path that is that of a single file.
struct Sources {
  std::unique_ptr<FrameSource> reference, candidate;
};

/// The frames to compare by increasing numbers: those of --frames, or those of either sequence.
std::set<FrameNumber> wantedFrames(const CheckOptions& options, const Sources& sources) {
  if (options.frames) return {options.frames->begin(), options.frames->end()};
  std::set<FrameNumber> all(sources.reference->numbers().begin(),
                            sources.reference->numbers().end());
  all.insert(sources.candidate->numbers().begin(), sources.candidate->numbers().end());
  return all;
}

bool has(const FrameSource& source, FrameNumber frame) {
  return std::ranges::binary_search(source.numbers(), frame);
}

/// Says which frames a sequence lacks.
void noteMissing(const std::set<FrameNumber>& wanted, const FrameSource& source,
                 const std::string& name, CheckRecord& record) {
  std::vector<FrameNumber> missing;
  std::ranges::copy_if(wanted, std::back_inserter(missing),
                       [&](FrameNumber frame) { return !has(source, frame); });
  if (!missing.empty())
    record.failures.push_back(cli::sentenceOn(missing, wanted.size(), "are not in " + name));
}

void appendLines(const std::string& frame, const std::vector<std::string>& lines,
                 std::vector<std::string>& all) {
  for (const auto& line : lines) all.push_back(frame + line);
}

/// Appends the record of a frame to that of the sequence.
void append(FrameNumber number, CheckRecord from, CheckRecord& to) {
  const std::string frame = "frame " + std::to_string(number) + ": ";
  for (CheckedGrid& grid : from.grids) {
    grid.frame = number;
    grid.name = frame + grid.name;
    to.grids.push_back(std::move(grid));
  }
  for (Difference& difference : from.fileDifferences) {
    difference.text = frame + difference.text;
    to.fileDifferences.push_back(std::move(difference));
  }
  appendLines(frame, from.same, to.same);
  appendLines(frame, from.skipped, to.skipped);
  appendLines(frame, from.extra, to.extra);
  appendLines(frame, from.failures, to.failures);
  appendLines(frame, from.unreadable, to.unreadable);
  appendLines(frame, from.notes, to.notes);
}

/// Compares the frames of two sequences, each with the frame of the same number and with the change
/// from the frame before it. A frame that only one of them has is a failure. The names of grids in
/// the record begin with the frame: "frame 7: density".
CheckRecord checkSequence(const CheckOptions& options, const Sources& sources,
                          const CancelToken& cancel) {
  if (!sources.reference || !sources.candidate)
    throw UsageError(
        "a sequence can be compared with a sequence only: a pattern such as "
        "smoke.####.vdb, or an .esvr file that holds a sequence");
  const cli::Log log(kProgram, options.verbosity);
  for (const auto& source : {&sources.reference, &sources.candidate})
    if (const std::string hint = (*source)->hint(options.frames ? &*options.frames : nullptr);
        !hint.empty())
      log.warning(hint);
  CheckRecord record;
  const auto wanted = wantedFrames(options, sources);
  noteMissing(wanted, *sources.reference, options.reference.string(), record);
  noteMissing(wanted, *sources.candidate, options.candidate.string(), record);
  TemporalComparison temporal(options);
  std::vector<FrameNumber> compared;
  for (const FrameNumber frame : wanted) {
    if (!has(*sources.reference, frame) || !has(*sources.candidate, frame)) continue;
    const GridFile reference = sources.reference->open(frame);
    const GridFile candidate = sources.candidate->open(frame);
    temporal.beginFrame();
    append(frame, compareFiles(options, {reference, candidate, cancel}, &temporal), record);
    compared.push_back(frame);
  }
  if (compared.empty()) throw BadInput("the two sequences have no frame in common");
  record.candidateBytes = sources.candidate->bytesOf(compared);
  return record;
}

}  // namespace

// Results.

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kCheckSchema = "esvr-check";
constexpr int kCheckVersion = 1;
constexpr std::size_t kWidth = 100;  // columns of the table

void printFigures(const CheckRecord& record, std::ostream& out) {
  if (record.grids.empty()) return;
  std::vector<Figure> shown;  // those that any grid has
  for (const Figure& figure : allFigures())
    if (std::ranges::any_of(record.grids, [&](const CheckedGrid& grid) {
          return valueOf(grid.figures, figure).has_value();
        }))
      shown.push_back(figure);
  std::vector<std::string> header{"grid"};
  for (const Figure& figure : shown) header.push_back(figure.header);
  cli::Table table(header);
  for (const auto& grid : record.grids) {
    std::vector<std::string> row{grid.name};
    for (const Figure& figure : shown) {  // a grid of the first frame has no temporal difference
      const auto value = valueOf(grid.figures, figure);
      row.push_back(value ? textOf(figure, *value) : "-");
    }
    table.add(row);
  }
  table.print(out, kWidth);
}

void printLines(std::ostream& out, const std::string& prefix,
                const std::vector<Difference>& differences) {
  for (const auto& difference : differences)
    out << cli::printable(prefix + difference.text) << '\n';
}

void printLines(std::ostream& out, const std::string& prefix,
                const std::vector<std::string>& lines) {
  for (const auto& line : lines) out << cli::printable(prefix + line) << '\n';
}

void printCheck(const CheckRecord& record, std::ostream& out) {
  printFigures(record, out);
  printLines(out, "file ", record.fileDifferences);
  for (const auto& grid : record.grids)
    printLines(out, "grid \"" + grid.name + "\": ", grid.differences);
  for (const auto& name : record.extra)
    out << cli::printable("grid \"" + name + "\" is not in the reference") << '\n';
  printLines(out, "", record.same);
  printLines(out, "skipped ", record.skipped);
  printLines(out, "", record.notes);
}

Json toJson(const std::vector<Difference>& differences) {
  Json list = Json::array();
  for (const auto& d : differences)
    list.push_back({{"kind", cli::wordOf(d.kind, kDifferenceNames)}, {"text", d.text}});
  return list;
}

Json toJson(const CheckedGrid& grid) {
  Json json{{"name", grid.name}, {"candidate_name", grid.candidateName}};
  for (const Figure& figure : allFigures()) {
    const auto value = valueOf(grid.figures, figure);
    if (value) json[figure.key] = finiteOrNull(*value);
  }
  const Coord at = grid.metrics.maxErrorAt;
  json["frame"] = grid.frame ? Json(*grid.frame) : Json(nullptr);
  json["max_error_at"] = {at.x, at.y, at.z};
  json["peak"] = grid.metrics.peak > 0.0 ? Json(grid.metrics.peak) : Json();
  json["differences"] = toJson(grid.differences);
  return json;
}

Json checkReport(const CheckOptions& options, const CheckRecord& record) {
  Json grids = Json::array();
  for (const auto& grid : record.grids) grids.push_back(toJson(grid));
  return {{"schema", kCheckSchema},
          {"schema_version", kCheckVersion},
          {"command_line", options.commandLine},
          {"reference", options.reference.string()},
          {"candidate", options.candidate.string()},
          {"bytes", record.candidateBytes},
          {"grids", std::move(grids)},
          {"file_differences", toJson(record.fileDifferences)},
          {"extra", record.extra},
          {"same", record.same},
          {"skipped", record.skipped},
          {"failures", record.failures},
          {"unreadable", record.unreadable},
          {"notes", record.notes}};
}

}  // namespace

// The command.

namespace {

void checkFiles(const CheckOptions& options) {
  std::vector<std::filesystem::path> inputs, outputs{options.report};
  for (const auto& input : {options.reference, options.candidate})
    std::ranges::copy(cli::filesOfInput(input.string()), std::back_inserter(inputs));
  if (options.baseline) (options.update ? outputs : inputs).push_back(*options.baseline);
  cli::requireSeparate(inputs, outputs);
  if (!options.report.empty() && options.report != cli::kStandardOutput)
    cli::checkOutput(options.report, {".json"}, options.overwrite);
  if (options.update) cli::checkOutput(*options.baseline, {".json"}, true);
}

/// Compares the files or the sequences, and judges the size.
CheckRecord compared(const CheckOptions& options, const CancelToken& cancel) {
  const Sources sources{FrameSource::in(options.reference.string(), options.memory),
                        FrameSource::in(options.candidate.string(), options.memory)};
  if (sources.reference || sources.candidate) return checkSequence(options, sources, cancel);
  if (options.frames || options.limits[std::size_t(FigureId::kPsnrTemporal)])
    throw UsageError("--frames and --min-psnr-temporal need sequences");
  const GridFile reference(options.reference, options.memory),
      candidate(options.candidate, options.memory);
  return compareFiles(options, {reference, candidate, cancel}, nullptr);
}

void tell(const CheckOptions& options, const CheckRecord& record) {
  if (!options.report.empty())
    cli::writeJson({options.report, options.overwrite}, checkReport(options, record));
  if (options.report != cli::kStandardOutput && options.verbosity != cli::Verbosity::kQuiet)
    printCheck(record, std::cout);
}

/// A missed limit or a difference counts more than a grid that cannot be read.
void throwFailures(const CheckOptions& options, const CheckRecord& record) {
  if (record.failures.empty() && record.unreadable.empty()) return;
  std::string text = options.candidate.string() + " fails:";
  for (const auto& failure : record.failures) text += "\n  " + failure;
  for (const auto& failure : record.unreadable) text += "\n  " + failure;
  if (record.failures.empty()) throw BadInput(text);
  throw TargetMissed(text);
}

}  // namespace

void check(const CheckOptions& options) {
  const cli::ThreadLimit threads(options.threads);
  const cli::Interrupts interrupts;
  checkFiles(options);
  CheckRecord record = compared(options, interrupts.token());
  judgeBytes(options, record);
  if (options.baseline && !options.update) judgeBaseline(*options.baseline, record);

  tell(options, record);
  throwFailures(options, record);
  if (options.update) updateBaseline(*options.baseline, record);
}

}  // namespace esvr::compare
