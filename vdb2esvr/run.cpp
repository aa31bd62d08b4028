// The main function of vdb2esvr after its options are read: one file.
#include "vdb2esvr/run.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "esvr/convert_file.h"
#include "esvr/error.h"
#include "programs/command_line.h"
#include "programs/files.h"
#include "programs/option_values.h"
#include "programs/resources.h"
#include "vdb2esvr/convert.h"
#include "vdb2esvr/progress_bar.h"

namespace esvr::vdb2esvr {
namespace {

namespace fs = std::filesystem;

// Where the parts of fits in chunks run (docs/scale.md).

/// The folder of a run's finished parts: that of OUT.esvr is OUT.esvr.parts.
fs::path partsFolder(const Options& options) { return options.output.string() + ".parts"; }

/// The properties of the input file that change with its content.
void addInput(const fs::path& input, std::vector<PartOrigin>& origin) {
  std::error_code error;
  const fs::path path = fs::canonical(input, error);
  if (error) throw BadInput("cannot read " + input.string() + ": " + error.message());
  const auto changed = fs::last_write_time(path).time_since_epoch().count();
  origin.push_back({"input", path.string()});
  origin.push_back({"input's size", std::to_string(fs::file_size(path))});
  origin.push_back({"input's time of change", std::to_string(changed)});
}

/// What decides the result of a conversion beside its input.
std::vector<PartOrigin> originOf(const Options& options) {
  std::vector<PartOrigin> origin{{"version", cli::programVersion()}};
  const auto asked = askedJson(options);
  for (const auto& [name, value] : asked.items())
    if (name != "threads" && name != "device") origin.push_back({name, value.dump()});
  std::string grids;
  for (const auto& grid : options.grids.only) grids += '"' + grid + '"';
  origin.push_back({"grids", grids});
  return origin;
}

std::vector<PartOrigin> originOf(const Options& options, const Device& device) {
  std::vector<PartOrigin> origin = originOf(options);
  addInput(options.input, origin);
  origin.push_back({"kind of device", device.kind == DeviceKind::kCpu ? "CPU" : "GPU"});
  return origin;
}

/// Each GPU twice: while it fits a part, the next one is prepared on the host.
std::vector<Device> withPreparation(const std::vector<Device>& devices) {
  std::vector<Device> workers = devices;
  std::ranges::copy_if(devices, std::back_inserter(workers),
                       [](const Device& device) { return device.kind == DeviceKind::kCuda; });
  return workers;
}

/// Runs the parts on devices or ranks, and keeps those that are finished for --resume.
class Parts {
 public:
  /// Opens the folder of finished parts for --resume.
  /// \param device  the device that fits parts
  /// \param ranks   the processes that share the parts; may be null
  /// \throws BadInput  the folder belongs to another input, to other options or to fits on another
  ///                   kind of device
  Parts(const Options& options, const Device& device, Ranks* ranks);

  /// \param devices  the devices that fit parts; the runner is valid until the next call
  /// \param onLost   is told when one of several devices fails
  [[nodiscard]] PartRunner* runOn(const std::vector<Device>& devices, LostDevice onLost);

  /// True if the parts are shared with the ranks of MPI, which must all do the same.
  [[nodiscard]] bool haveRanks() const { return ranks_ != nullptr; }

  /// Removes the folder.
  void remove();

 private:
  Ranks* ranks_;
  std::optional<PartStore> store_;
  std::unique_ptr<PartRunner> runner_;
};

Parts::Parts(const Options& options, const Device& device, Ranks* ranks) : ranks_(ranks) {
  if (!options.resume) return;
  store_.emplace(partsFolder(options), originOf(options, device),
                 ranks ? PartStore::Access::kShared : PartStore::Access::kAlone);
}

PartRunner* Parts::runOn(const std::vector<Device>& devices, LostDevice onLost) {
  PartStore* const store = store_ ? &*store_ : nullptr;
  if (ranks_)
    runner_ = std::make_unique<RankWorkers>(*ranks_, devices, store);
  else
    runner_ = std::make_unique<DeviceWorkers>(withPreparation(devices), std::move(onLost), store);
  return runner_.get();
}

void Parts::remove() {
  if (store_) store_->remove();
}

// A run.

void checkFiles(const Options& options) {
  cli::requireSeparate(options.inputs.paths, {options.output, options.report});
  const bool mayExist = options.overwrite || options.onlyFits;  // it is not written
  cli::checkOutput(options.output, {".esvr"}, mayExist);
  if (reportIsFile(options)) cli::checkOutput(options.report, {".json"}, options.overwrite);
}

constexpr const char* kAuto = "auto";

void tellDevices(const std::vector<Device>& devices, const Options& options, const cli::Log& log) {
  std::string names;
  for (const Device& device : devices) names += (names.empty() ? "" : ", ") + deviceName(device);
  log.detail("fitting on " + names + ", with " +
             (options.threads > 0 ? std::to_string(options.threads) : "all available") +
             " threads");
}

void tellNothingFitted(const GridChoice& choice, const cli::Log& log) {
  if (!choice.fitted.empty()) return;
  if (choice.carried.empty())
    return log.warning("the file has no grid; the output has its metadata only");
  log.warning("no grid is fitted; the output has carried grids only",
              std::to_string(choice.carried.size()) + " of " +
                  cli::counted(choice.carried.size() + choice.skipped.size(), "grid") +
                  " carried unchanged");
}

void tellGrid(const Options& options, const ConvertedGrid& grid, const cli::Log& log) {
  const std::string replacement = options.read.nonFinite == NonFinite::kBackground
                                      ? "the background"
                                      : cli::shortNumber(options.read.nonFiniteValue);
  if (grid.nonFiniteReplaced > 0)
    log.warning(
        "grid \"" + grid.uniqueName + "\": NaN or infinite voxels were replaced by " + replacement,
        cli::counted(grid.nonFiniteReplaced, "voxel"));
  if (const NonFiniteCounts& kept = grid.stored().nonFinite; kept.total() > 0)
    log.info("grid \"" + grid.uniqueName + "\": " + cli::textOf(kept) +
             (kept.total() == 1 ? " is kept" : " are kept") +
             ", and all errors are those of the others");
  if (grid.stored().descriptor.gridClass == GridClass::kLevelSet && grid.inactive.min() < 0.0)
    log.warning(
        "grid \"" + grid.uniqueName +
        "\": the signs of inactive voxels inside the surface are lost; --lossless or --keep "
        "keeps them");
  if (const std::string why = whyImprecise(grid.stored()); !why.empty())
    log.warning("grid \"" + grid.uniqueName + "\": " + why);
  if (grid.isBoxEmpty)
    log.warning("grid \"" + grid.uniqueName + "\" has no active voxel in the box of --box");
  if (const FitResult& fit = grid.conversion.fit; fit.deviceFull)
    log.warning("grid \"" + grid.uniqueName + "\": the memory of the GPU was full",
                cli::counted(grid.stored().field.ellipsoidCount(), "ellipsoid") + " instead of " +
                    std::to_string(fit.wanted));
  log.detail("grid \"" + grid.uniqueName + "\": kappa " +
             cli::shortNumber(grid.stored().field.kernel.kappa) + ", " +
             cli::activityOf(grid.stored()) + ", overlap of active voxels " +
             cli::shortNumber(grid.metrics.iou));
}

/// The largest size of the file. A frame of a sequence in which nothing is active has none, because no size
/// could make it smaller.
std::optional<std::uint64_t> sizeOf(const Options& options, const GridChoice& choice,
                                    const VdbSummary& input) {
  const auto isActive = [](const GridSummary& grid) { return grid.activeVoxels > 0; };
  if (options.sequence && std::ranges::none_of(choice.fitted, isActive, &FittedGrid::source) &&
      std::ranges::none_of(choice.carried, isActive, &NotFitted::grid))
    return std::nullopt;
  if (options.size || !options.ratio) return options.size;
  return std::uint64_t(double(input.fileBytes) / *options.ratio);
}

/// Converts the grids of a file: shows the progress of each, goes on with another device where one fails, and
/// measures what was made.
class FileConversion {
 public:
  FileConversion(const Options& options, const std::vector<Device>& devices,
                 const CancelToken& cancel, Parts& parts, const cli::Log& log)
      : options_(options),
        parts_(parts),
        log_(log),
        started_(mayFit(options) ? std::async(std::launch::async,
                                              [devices] {
                                                for (const auto& d : devices) startDevice(d);
                                              })
                                 : std::future<void>()) {
    options_.convert.fit.cancel = &cancel;
    runOn(devices);
  }

  /// Adds the grids, the vectors and what became of them to the record.
  ConvertedFile run(const GridChoice& choice, RunRecord& record) {
    fitted_ = choice.fitted;
    measured_.resize(fitted_.size());
    FileSource source = sourceOf(options_, record.input, choice);
    if (needsOnlyFits())
      for (GridSource& grid : source.grids) grid.readCarried = nullptr;
    ConvertedFile made = convertGrids(std::move(source), optionsOfFile(choice, record.input));
    for (const GridConversion& grid : made.grids) record.grids.push_back(recordOf(grid));
    listVectors(made, record);
    listCarried(made, record);
    record.interrupted = made.interrupted, record.isTooLarge = made.isTooLarge;
    record.abovePreset = made.abovePreset;
    if (record.interrupted && (!options_.keepsBest() || record.grids.empty()))
      throw RuntimeFailure("interrupted; " + whatIsLeft());
    return made;
  }

 private:
  /// True if the fits of this rank are all that counts. For a size, what follows decides which fits come next.
  [[nodiscard]] bool needsOnlyFits() const {
    return options_.onlyFits && !options_.size && !options_.ratio;
  }

  /// What an interrupted run leaves.
  [[nodiscard]] std::string whatIsLeft() const {
    if (!options_.resume) return "nothing was written";
    return "the finished parts are in " + partsFolder(options_).string() +
           ", and the same command continues";
  }

  FileOptions optionsOfFile(const GridChoice& choice, const VdbSummary& input) {
    FileOptions options{.convert = options_.convert};
    options.size = sizeOf(options_, choice, input);
    options.shares = options_.shares && !needsOnlyFits();
    options.severalAtOnce = !parts_.haveRanks();
    options.paper = options_.paper;
    options.previous = options_.previous;
    options.onStep = [this](const GridStep& step) { runStep(step); };
    options.onConverted = [this](const VolumeGrid& grid, const GridConversion& made) {
      measured_[made.source] = measured(options_, fitted_[made.source], grid, made, device());
    };
    // The parts of a single fit do not depend on the storage, and compact storage takes time.
    if (options_.onlyFits && std::holds_alternative<FitGoal>(options.convert.goal))
      options.convert.storage.form = Storage::kFloat32;
    return options;
  }

  /// Runs a step. If a device fails, for example because its memory is full, the next one of several, or the
  /// CPU in place of the GPU that "auto" selected, takes this step and all later ones.
  void runStep(const GridStep& step) {
    const FittedGrid& grid = fitted_[step.grid];
    if (!step.isAlone) return sayingTheWayOut(grid, step.run);
    ProgressBar bar(grid.uniqueName, options_.progress, options_.verbosity);
    step.fit.progress = [&](const FitProgress& progress) { bar.show(progress); };
    for (;;) {
      step.fit.device = device();
      step.fit.parts = options_.convert.fit.parts;
      try {
        return sayingTheWayOut(grid, step.run);
      } catch (const DeviceError& error) {
        if (!replaceDevice(error)) throw;
      }
    }
  }

  /// The device of fits, which is another one if the first has failed.
  [[nodiscard]] const Device& device() const { return options_.convert.fit.device; }

  void runOn(std::vector<Device> devices) {
    devices_ = std::move(devices);
    options_.convert.fit.device = devices_.front();
    options_.convert.fit.parts =
        parts_.runOn(devices_, [this](const Device& device, const std::string& why) {
          tellLost(device, why, "the other devices go on");
        });
  }

  void tellLost(const Device& device, const std::string& why, const std::string& next) const {
    log_.warning(deviceName(device) + " is not used any more: " + why + "; " + next);
  }

  /// \return false if there is no device to go on with
  bool replaceDevice(const DeviceError& error) {
    const Device failed = device();
    if (parts_.haveRanks() || failed.kind == DeviceKind::kCpu) return false;
    std::vector<Device> left = devices_;
    std::erase(left, failed);
    const bool toCpu = left.empty() && options_.device == kAuto;
    if (toCpu) left = {Device{}};
    if (left.empty()) return false;
    tellLost(failed, error.what(),
             toCpu ? "continuing on the CPU" : "continuing on " + deviceName(left.front()));
    runOn(std::move(left));
    return true;
  }

  /// What was measured of a grid, or of the one whose voxels it has.
  [[nodiscard]] ConvertedGrid recordOf(const GridConversion& made) const {
    const FittedGrid& fitted = fitted_[made.source];
    ConvertedGrid grid = *measured_[made.convertedAs];
    static_cast<GridConversion&>(grid) = made;
    grid.uniqueName = fitted.uniqueName;
    grid.sourceName = fitted.source.uniqueName;
    grid.id = {fitted.place, fitted.component};
    if (made.convertedAs != made.source) grid.seconds = {.read = made.secondsRead};
    if (made.twinOf) grid.sameAs = fitted_[*made.twinOf].uniqueName;
    if (made.shared && made.shared->with) grid.sharesWith = fitted_[*made.shared->with].uniqueName;
    return grid;
  }

  void listVectors(const ConvertedFile& made, RunRecord& record) const {
    for (const StoredVector& vector : made.file.vectors) {
      const FittedGrid& grid = fitted_[made.grids[vector.first].source];
      record.vectors.push_back({grid.source.uniqueName, grid.place, grid.source.valueType, vector});
    }
  }

  /// Lists the vectors that are carried after all, at their places, and the grids that were not converted.
  void listCarried(const ConvertedFile& made, RunRecord& record) const {
    for (const auto& [place, bytes] : made.carriedVectors) {
      const auto at = std::ranges::lower_bound(record.carried, place, {}, &NotFitted::place);
      record.carried.insert(at, {record.input.grids[place], place,
                                 "its components would take " + std::to_string(bytes) + " bytes"});
    }
    for (std::size_t g = 0; g < fitted_.size(); ++g)
      if (std::ranges::count(made.grids, g, &GridConversion::source) == 0 &&
          std::ranges::count(made.carriedVectors, fitted_[g].place, &CarriedVector::place) == 0)
        record.notFitted.push_back(fitted_[g].uniqueName);
  }

  Options options_;
  Parts& parts_;
  const cli::Log& log_;
  std::vector<Device> devices_;  ///< those that have not failed
  std::future<void> started_;    ///< the device starts while the first grid is read; may be empty
  std::vector<FittedGrid> fitted_;
  std::vector<std::optional<ConvertedGrid>> measured_;  ///< of `fitted_`
};

void tellResult(const Options& options, const RunRecord& record) {
  const Completion completion;  // an interrupted run tells what it has written
  if (!options.report.empty())
    cli::writeJson({options.report, options.overwrite}, makeReport(options, record));
  if (options.report != cli::kStandardOutput && options.verbosity != cli::Verbosity::kQuiet)
    printSummary(options, record, std::cout);
}

/// Throws the error that gives the exit code of a run that wrote its file but was interrupted or
/// missed the PSNR.
void throwWhatIsAmiss(const Options& options, const RunRecord& record) {
  if (record.interrupted) {
    std::string text = "interrupted; " + options.output.string() + " has the best result so far";
    if (record.isTooLarge) text += ", which is larger than the size";
    for (const auto& name : record.notFitted) text += ", without grid \"" + name + "\"";
    throw RuntimeFailure(text);
  }
  if (const ConvertedGrid* grid = firstBelow(record)) {
    const auto [reached, wanted] = cli::decibelsApart(grid->metrics.psnrBox, *grid->wantedPsnr);
    throw TargetMissed("grid \"" + grid->uniqueName + "\" reached " + reached + " dB instead of " +
                       wanted + " dB; " + options.output.string() + " was written");
  }
}

/// The devices of this process. The ranks of a host take its GPUs in turn.
std::vector<Device> devicesFor(const Options& options, const Ranks* ranks) {
  if (!ranks) return selectDevices(options.device);
  const bool isAny = options.device == kAuto || options.device == "cuda";
  std::vector<Device> devices = selectDevices(options.device);
  if (isAny && devices.front().kind == DeviceKind::kCuda) devices = selectDevices("cuda:all");
  return {devices[std::size_t(ranks->rankOnHost()) % devices.size()]};
}

}  // namespace

bool mayFit(const Options& options) {
  return !std::holds_alternative<LosslessGoal>(options.convert.goal) &&
         options.convert.representation != Representation::kVoxels;
}

GridChoice chooseFor(Options& options, const VdbSummary& input) {
  if (input.grids.empty() && options.sequence) return {};
  resolveNames(input, options);
  return chooseGrids(options.input, input, options.grids);
}

std::uint64_t hashOfOrigin(const Options& options) {
  std::string all;
  for (const auto& [name, value] : originOf(options)) all += name + '=' + value + '\n';
  return std::hash<std::string>()(all);
}

StoreFile writingTo(const Options& options) {
  return [&options](const EsvrFile& file) {
    writeEsvr(options.output, file, {.overwrite = options.overwrite});
    return inspectEsvr(options.output);
  };
}

namespace {

/// The grids are in a file that was made of splats, whose size is none of the user's.
void takeSizeOf(const fs::path& splats, RunRecord& record) {
  record.isOfSplats = true;
  record.input.fileBytes = fs::file_size(splats);
  record.input.format = "PLY";
}

RunRecord convertWatched(const Options& given, const FileRun& run,
                         const cli::WatchedInputs& watched) {
  Ranks* const ranks = run.ranks;
  const CancelToken& cancel = run.cancel;
  const cli::Log& log = run.log;
  cli::Stopwatch watch;
  RunRecord record;
  const CancelScope scope(&cancel);
  auto devices = std::async(std::launch::async, [&] { return devicesFor(given, ranks); });
  record.input = inspectVdb(given.input);
  if (given.splats) takeSizeOf(given.splats->path, record);
  Options options = given;
  options.read.directory = record.input.directory;
  GridChoice choice = chooseFor(options, record.input);
  carryInactiveValues(
      options, [&](std::string text) { log.warning(std::move(text)); }, choice);
  tellNothingFitted(choice, log);
  record.carried = choice.carried;
  record.skipped = std::move(choice.skipped);
  const std::vector<Device> selected = devices.get();
  tellDevices(selected, options, log);
  Parts parts(options, selected.front(), ranks);
  const ConvertedFile made = namingFile(given.namedInput().string(), [&] {
    return FileConversion(options, selected, cancel, parts, log).run(choice, record);
  });
  for (const auto& grid : record.grids) tellGrid(options, grid, log);
  if (options.onlyFits) return record;
  watched.requireUnchanged();  // the grids were read one after the other
  // There is nothing of a lossless conversion to keep before it is complete.
  std::optional<Completion> completion;
  if (!std::holds_alternative<LosslessGoal>(options.convert.goal)) completion.emplace();
  cli::Stopwatch writing;
  record.output = run.store(made.file);
  record.secondsWrite = writing.lap();
  if (!completion) completion.emplace();  // the file is there, and so will be its report
  for (ConvertedVector& vector : record.vectors)
    if (!record.interrupted)
      vector.metrics = measureVector(options, made.file, vector.stored, vector.place);
  if (made.isShared) record.bytesSeparate = bytesWithoutSharing(made, record.output);
  if (!record.interrupted) parts.remove();
  record.secondsTotal = watch.lap();
  return record;
}

}  // namespace

RunRecord convertFile(const Options& given, const FileRun& run) {
  const cli::WatchedInputs watched({given.input});
  try {
    return convertWatched(given, run, watched);
  } catch (const BadInput&) {
    watched.requireUnchanged();  // what was read may be a mixture of two files
    throw;
  }
}

namespace {

/// Converts the file; if that fails, writes a report of the failure.
RunRecord convertOrReport(const Options& options, Ranks* ranks, const cli::Interrupts& interrupts,
                          const cli::Log& log) try {
  return convertFile(options, {ranks, interrupts.token(), log, writingTo(options)});
} catch (const Error& error) {
  if (!options.report.empty())
    cli::writeJson({options.report, options.overwrite}, makeFailureReport(options, error));
  throw;
}

/// The options of a rank. Rank 0 writes the file; the others only fit parts.
Options optionsOf(const Options& options, const Ranks* ranks) {
  if (!ranks) return options;
  if (options.paper) throw UsageError("fits by --paper have no parts for the ranks of MPI");
  Options own = options;
  if (ranks->rank() == 0) return own;
  own.onlyFits = true;
  own.report.clear();
  own.progress = ProgressForm::kText;
  own.verbosity = cli::Verbosity::kQuiet;
  return own;
}

/// Open MPI kills the ranks a second after it has told them to end.
void tellWhatSurvives(const Options& options, const cli::Log& log) {
  if (options.resume)
    return log.info("if MPI ends this run early, its finished parts stay in " +
                    partsFolder(options).string() + ", and the same command continues");
  log.info(
      "if MPI ends this run early, the best result so far is written if that takes less than the "
      "second that Open MPI leaves (OMPI_MCA_odls_base_sigkill_timeout=10 leaves 10); --resume "
      "keeps the finished parts in any case");
}

/// The number of cores that a process may use (0: this one), or 0 if the system does not tell.
int coresOf(pid_t process) {
  cpu_set_t cores;
  return ::sched_getaffinity(process, sizeof cores, &cores) == 0 ? CPU_COUNT(&cores) : 0;
}

/// Open MPI binds each of one or two ranks to a core, on which all work of the host then runs. Its own
/// process may use what the ranks of this host have together. A single rank runs without messages, and is bound, too.
void warnOfFewCores(const cli::Log& log) {
  const char* const ranks = std::getenv("OMPI_COMM_WORLD_LOCAL_SIZE");
  const int own = coresOf(0), all = coresOf(::getppid());
  if (ranks == nullptr || own == 0 || 2 * own * std::max(std::atoi(ranks), 1) > all) return;
  log.warning("each rank of this host uses " + std::to_string(own) + " of its " +
              std::to_string(all) + " cores; mpirun --bind-to none gives them all cores");
}

int runAs(const Options& options, Ranks* ranks) {
  const cli::Log log(kProgram, options.verbosity);
  const cli::ThreadLimit threads(options.threads);
  cli::Interrupts interrupts(ranks ? cli::FurtherSignals::kAreIgnored
                                   : cli::FurtherSignals::kEndAtOnce);
  if (!options.keepsBest()) interrupts.discardResults();
  checkFiles(options);
  if (ranks) tellWhatSurvives(options, log);
  if (!ranks || ranks->rank() == 0) warnOfFewCores(log);
  const RunRecord record = convertOrReport(options, ranks, interrupts, log);
  if (options.onlyFits) {
    if (record.interrupted) throw RuntimeFailure("interrupted");  // as rank 0 does
    return 0;
  }
  tellResult(options, record);
  throwWhatIsAmiss(options, record);
  return 0;
}

/// Converts the grids that become of splats.
int runSplats(Options options, Ranks* ranks) {
  checkFiles(options);
  std::optional<cli::SplatsAsVdb> vdb;
  {
    const cli::Interrupts interrupts;
    const cli::ThreadLimit threads(options.threads);
    vdb.emplace(*options.splats, cli::Log(kProgram, options.verbosity));
  }
  options.input = vdb->path();
  return runAs(optionsOf(options, ranks), ranks);
}

}  // namespace

int run(const Options& options, Ranks* ranks) {
  if (options.sequence) return runSequence(options, ranks);
  if (options.splats) return runSplats(options, ranks);
  return runAs(optionsOf(options, ranks), ranks);
}

}  // namespace esvr::vdb2esvr
