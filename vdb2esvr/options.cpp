// Reads the options of vdb2esvr, and finds the grids that they name.
#include "vdb2esvr/options.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <variant>

#include "esvr/error.h"
#include "programs/resources.h"
#include "vdb2esvr/convert.h"

namespace esvr::vdb2esvr {

// Goals of single grids.

namespace {

constexpr double kHighestPsnr = 300.0;  // dB; float32 reaches about 150

/// One of the values of an option, between commas.
struct NamedValue {
  std::string grid;  ///< empty: all others
  std::string value;
};

std::vector<NamedValue> valuesOf(const std::string& option, const std::string& text) {
  std::vector<NamedValue> values;
  for (const std::string& part : cli::splitText(text, ',')) {
    const std::size_t at = part.rfind('=');
    const bool isNamed = at != std::string::npos;
    values.push_back({isNamed ? part.substr(0, at) : "", isNamed ? part.substr(at + 1) : part});
    if (isNamed && values.back().grid.empty())
      throw UsageError("--" + option + ": there is no name before '=' in '" + text + "'");
  }
  if (std::ranges::count(values, std::string(), &NamedValue::grid) > 1)
    throw UsageError("--" + option + ": '" + text + "' has two values without a name");
  return values;
}

double psnrIn(const std::string& text) {
  const auto psnr = cli::parseNumber(text);
  if (!psnr) throw UsageError("--psnr must be a number such as 40, not '" + text + "'");
  cli::requireRange("psnr", *psnr, 0.0, kHighestPsnr);
  return *psnr;
}

void addGoal(const std::string& grid, Goal goal, Options& options) {
  if (std::ranges::count(options.gridGoals, grid, &GridGoal::grid) > 0)
    throw UsageError("grid \"" + shownName(grid) + "\" has two goals");
  options.gridGoals.push_back({grid, std::move(goal)});
}

void readPsnr(const std::string& text, Options& options) {
  for (const NamedValue& value : valuesOf("psnr", text))
    if (value.grid.empty())
      options.psnr = psnrIn(value.value);
    else
      addGoal(value.grid, PsnrGoal{psnrIn(value.value)}, options);
}

void readMaxError(const std::string& text, Options& options) {
  for (const NamedValue& value : valuesOf("max-error", text)) {
    const cli::ErrorBound bound = cli::parseErrorBound("max-error", value.value);
    if (value.grid.empty())
      options.maxError = BoundGoal{bound.amount, bound.relative};
    else
      addGoal(value.grid, BoundGoal{bound.amount, bound.relative}, options);
  }
}

/// Reads the values of --psnr and --max-error, such as "40" or "40,density=50": the value without a
/// name is that of all grids that are not named.
void readGridGoals(const cli::Arguments& a, Options& options) {
  if (const auto text = a.find<std::string>("psnr")) readPsnr(*text, options);
  if (const auto text = a.find<std::string>("max-error")) readMaxError(*text, options);
}

}  // namespace

void resolveNames(const VdbSummary& input, Options& options) {
  const GridNames names = namesOf(input);
  std::set<std::size_t> withGoals;
  for (GridGoal& own : options.gridGoals) {
    own.place = names.findWhole(own.grid, options.input);
    if (!withGoals.insert(own.place).second)
      throw UsageError("grid \"" + names.unique(own.place) + "\" has two goals");
  }
}

std::optional<Goal> ownGoalOf(const Options& options, const FittedGrid& grid) {
  const auto own = std::ranges::find(options.gridGoals, grid.place, &GridGoal::place);
  return own == options.gridGoals.end() ? std::nullopt : std::optional(own->goal);
}

std::optional<double> wantedPsnrOf(const Options& options, const FittedGrid& grid) {
  const auto own = ownGoalOf(options, grid);
  if (!own) return options.psnr;
  const auto* psnr = std::get_if<PsnrGoal>(&*own);
  return psnr ? std::optional(psnr->psnr) : std::nullopt;
}

// All options.

namespace {

using cli::Arguments;
using cli::requireRange;

constexpr std::int64_t kMaxIterations = 10'000'000;
constexpr double kLongestRun = 1e9;  // seconds
constexpr double kLargestRatio = 1e9;

/// \throws UsageError  one of the options was given, which `given` excludes
void refuseWith(const Arguments& a, const std::string& given,
                std::initializer_list<const char*> options) {
  for (const char* option : options)
    if (a.isGiven(option)) throw UsageError("--" + given + " cannot be combined with --" + option);
}

/// An option's number, which must be within [low, high], converted to another type.
template <class To, class From>
std::optional<To> bounded(const Arguments& arguments, const std::string& option, From low,
                          From high) {
  const auto given = arguments.find<From>(option);
  if (!given) return std::nullopt;
  requireRange(option, *given, low, high);
  return To(*given);
}

FitOptions fitOptions(const Arguments& a) {
  FitOptions fit;
  fit.count = bounded<std::size_t>(a, "count", std::int64_t{1}, kMaxEllipsoids);
  fit.seconds = bounded<double>(a, "seconds", 1e-3, kLongestRun);
  fit.iterations = bounded<std::uint32_t>(a, "iterations", std::int64_t{1}, kMaxIterations);
  fit.preset = cli::choiceOf(a, "preset", kPresets);
  if (const auto memory = a.find<std::string>("max-vram"))
    fit.maxDeviceBytes = std::size_t(cli::parseDeviceMemory("max-vram", *memory));
  fit.chunkVoxels = bounded<std::uint64_t>(a, "chunk-voxels", std::int64_t{1},
                                           std::numeric_limits<std::int64_t>::max());
  if (const auto box = a.find<std::string>("box")) fit.box = cli::parseBox(*box);
  fit.seed =
      *bounded<std::uint64_t>(a, "seed", std::int64_t{0}, std::numeric_limits<std::int64_t>::max());
  return fit;
}

/// \return nothing: the conversion chooses
std::optional<ToneCurve> toneCurve(const Arguments& a) {
  const auto text = a.get<std::string>("tone");
  if (text == "auto") return std::nullopt;
  if (text == "off") return ToneCurve{};
  const auto scale = cli::parseNumber(text);
  const bool isScale = scale && std::isfinite(float(*scale)) && float(*scale) > 0.0f;
  if (!isScale)
    throw UsageError("--tone must be auto, off or a scale above 0 such as 0.1, not '" + text + "'");
  refuseWith(a, "tone S", {"lossless", "max-error", "max-relative-error", "paper"});
  return ToneCurve{float(*scale)};
}

Goal losslessGoal(const Arguments& a) {
  refuseWith(a, "lossless",
             {"max-error", "max-relative-error", "count", "psnr", "picture-psnr", "seconds", "size",
              "ratio", "paper"});
  return LosslessGoal{};
}

Goal boundGoal(const Arguments& a, const Options& options) {
  refuseWith(a, "max-error", {"max-relative-error", "count", "seconds", "size", "ratio", "paper"});
  if (options.psnr) throw UsageError("--max-error cannot be combined with --psnr");
  refuseWith(a, "max-error", {"picture-psnr"});
  return *options.maxError;
}

/// Refuses goals of single grids beside options that determine how all grids are converted.
void requireGridGoals(const Arguments& a, const Options& options) {
  if (options.gridGoals.empty()) return;
  refuseWith(a, "psnr NAME=DB and --max-error NAME=E",
             {"count", "seconds", "iterations", "size", "ratio", "paper"});
}

/// True if an option was given that determines a single fit.
bool isSingleFit(const Arguments& a) {
  return a.has("count") || a.has("seconds") || a.has("iterations") || a.has("paper");
}

/// The goal of all grids without one of their own (Options::gridGoals); a size replaces it later.
Goal commonGoal(const Arguments& a, const Options& options) {
  if (a.get<bool>("lossless")) return losslessGoal(a);
  requireGridGoals(a, options);
  if (options.maxError) return boundGoal(a, options);
  if (const auto text = a.find<std::string>("max-relative-error")) {
    refuseWith(a, "max-relative-error",
               {"picture-psnr", "psnr", "count", "seconds", "size", "ratio", "paper"});
    const cli::RelativeBound bound = cli::parseRelativeBound("max-relative-error", *text);
    return RelativeBoundGoal{bound.share, bound.floor};
  }
  if (options.picturePsnr) {
    refuseWith(a, "picture-psnr", {"psnr", "seconds", "size", "ratio", "paper"});
    return PictureGoal{*options.picturePsnr};
  }
  if (options.psnr && !options.convert.fit.seconds && !options.paper)
    return PsnrGoal{*options.psnr};
  return isSingleFit(a) ? Goal(FitGoal{}) : PresetGoal{};
}

void readSize(const Arguments& a, Options& options) {
  if (const auto size = a.find<std::string>("size"))
    options.size = cli::parseByteSize("size", *size);
  options.ratio = bounded<double>(a, "ratio", 1.0, kLargestRatio);
  if (!options.size && !options.ratio) return;
  const std::string given = options.size ? "size" : "ratio";
  if (options.size && options.ratio) throw UsageError("--size cannot be combined with --ratio");
  refuseWith(a, given, {"count", "psnr", "seconds", "paper"});
  if (options.convert.storage.form != Storage::kCompact)
    throw UsageError("--" + given + " needs --storage compact");
}

/// Reads --paper. The default storage of the paper's method is float32.
void readPaper(const Arguments& a, Options& options) {
  const auto given = a.find<std::vector<std::string>>("paper");
  if (!given) return;
  refuseWith(a, "paper", {"iterations", "preset", "chunk-voxels"});
  options.paper = readPaperMethod(*given);
  StorageOptions& storage = options.convert.storage;
  if (a.values["storage"].defaulted()) storage.form = Storage::kFloat32;
  if (options.paper->learnK && storage.form == Storage::kCompact)
    throw UsageError(
        "--paper k=learned needs --storage float32; compact storage has one edge for all "
        "ellipsoids");
}

/// \throws UsageError  the goal cannot be served by the representation
void requireRepresentation(const Arguments& a, const Options& options) {
  const Representation wanted = options.convert.representation;
  const bool sized = options.size || options.ratio;
  if (wanted == Representation::kEllipsoids && a.get<bool>("lossless"))
    throw UsageError("--representation ellipsoids cannot be combined with --lossless");
  if (wanted != Representation::kVoxels) return;
  if (std::holds_alternative<FitGoal>(options.convert.goal) && !sized)
    throw UsageError(
        "--representation voxels cannot be combined with --count, --seconds, --iterations or "
        "--paper");
  if (options.convert.storage.form == Storage::kFloat32)
    throw UsageError("--representation voxels cannot be combined with --storage float32");
}

/// \throws UsageError  the text is no word and no finite float
void readNonFinite(const Arguments& a, ReadOptions& read) {
  const auto text = a.get<std::string>("nonfinite");
  if (text == "refuse" || text == "error") return;
  if (text == "keep") {
    read.nonFinite = NonFinite::kKeep;
    return;
  }
  read.nonFinite = text == "background" ? NonFinite::kBackground : NonFinite::kValue;
  if (text == "zero" || text == "background") return;
  const auto value = cli::parseNumber(text);
  if (!value || !std::isfinite(float(*value)))
    throw UsageError(
        "--nonfinite must be refuse, keep, zero, background or a number such as -1, not '" + text +
        "'");
  read.nonFiniteValue = float(*value);
}

void readMemory(const Arguments& a, Options& options) {
  constexpr std::uint64_t kVolumes = 3;    // the source, its codes and what they decode to
  constexpr std::uint64_t kFitsShare = 2;  // one of two; the rest is for the volume and its copy
  const cli::HostMemory memory = cli::hostMemoryOf(a);
  options.read.maxBytes = memory.maxBytes;
  options.read.memory = memory.voxels;
  options.read.volumes = kVolumes;
  options.convert.fit.maxHostBytes = memory.maxBytes / kFitsShare;
}

void readResume(const Arguments& a, Options& options) {
  options.resume = a.get<bool>("resume");
  if (!options.resume) return;
  if (!options.inputs.piped.empty())
    throw UsageError("--resume continues in another run, which needs an input file, not a pipe");
  if (options.paper) throw UsageError("fits by --paper have no parts for --resume");
}

/// Reads the options of splats after those of a sequence and --resume.
void readSplats(const Arguments& a, Options& options) {
  if (!cli::isSplatFile(options.input))
    return cli::refuseOptions(a, "an input without splats", {"voxel-size", "density-scale", "up"});
  if (options.sequence)
    throw UsageError("splats are read from one file at a time; name a file without a pattern");
  if (options.resume)
    throw UsageError("--resume continues in another run, which needs a .vdb file, not splats");
  options.splats = {options.input, cli::scratchFolderOf(a), cli::splatInputOf(a),
                    cli::hostMemoryOf(a)};
}

/// Reads the options of a sequence after the goal, --resume and --force.
void readFrames(const Arguments& a, Options& options) {
  options.sequence = cli::readSequence(a, {.output = true});
  if (!options.sequence) return;
  if (options.resume && a.get<bool>("force"))
    throw UsageError(
        "--resume keeps the frames that are there, and --force replaces them; choose one");
}

}  // namespace

std::optional<Options> parseOptions(int argc, const char* const* argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const Arguments& a = *arguments;
  Options options;
  options.input = a.get<std::string>("input");
  options.output = a.get<std::string>("output");
  options.inputs = a.inputs;
  options.grids = {a.all("grid"), a.all("keep"), a.all("skip"), false};
  options.shares = cli::choiceOf(a, "share", kShares);
  readGridGoals(a, options);
  options.picturePsnr = bounded<double>(a, "picture-psnr", 0.0, kHighestPsnr);
  options.convert.measure = cli::choiceOf(a, "measure", kMeasures);
  options.convert.tone = toneCurve(a);
  options.convert.fit = fitOptions(a);
  options.convert.fit.psnr = options.psnr;
  options.convert.storage = {.form = cli::choiceOf(a, "storage", kStorages),
                             .activity = cli::choiceOf(a, "topology", kActivities)};
  readPaper(a, options);
  readSize(a, options);
  options.convert.goal = commonGoal(a, options);
  options.grids.lossless = a.get<bool>("lossless");
  options.convert.representation = cli::choiceOf(a, "representation", kRepresentations);
  options.convert.effort =
      *bounded<int>(a, "effort", std::int64_t{kLeastEffort}, std::int64_t{kMostEffort});
  requireRepresentation(a, options);
  readNonFinite(a, options.read);
  readMemory(a, options);
  options.device = cli::deviceOf(a);
  readResume(a, options);
  readFrames(a, options);
  readSplats(a, options);
  options.report = a.find<std::string>("report").value_or("");
  options.progress = cli::choiceOf<ProgressForm>(
      a, "progress", {{"text", ProgressForm::kText}, {"json", ProgressForm::kJson}});
  options.overwrite = a.get<bool>("force");
  options.threads = a.threads;
  options.verbosity = a.verbosity;
  options.commandLine.assign(argv, argv + argc);
  return options;
}

}  // namespace esvr::vdb2esvr
