// The rows of a table: the reference, the baselines that are compared with it, and the measurement of
// one row after the other from the same voxels.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "compare/external.h"
#include "compare/figures.h"
#include "compare/grid_file.h"
#include "compare/table.h"
#include "compare/table_record.h"
#include "esvr/baseline.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/fit.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "programs/option_values.h"
#include "programs/resources.h"
#include "programs/run_main.h"

namespace esvr::compare {
namespace {

// The reference.

/// A folder for temporary files in that of the variable TMPDIR, or in /var/tmp. The destructor
/// removes it with its content.
class ScratchFolder {
 public:
  /// \throws UsageError  TMPDIR is no folder
  /// \throws RuntimeFailure  the folder cannot be made
  ScratchFolder() {
    std::string pattern = cli::scratchFolder() / "esvr-compare-XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr)
      throw RuntimeFailure("cannot make a temporary folder with the pattern " + pattern);
    path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

VolumeGrid readReference(const GridFile& file, std::size_t place) {
  VolumeGrid reference = file.read(place);
  if (activeVoxelCount(reference.volume) == 0)
    throw BadInput(file.path().string() + ": grid \"" + file.grids()[place].uniqueName +
                   "\" has no active voxel");
  if (hasNonFinite(reference.volume))
    throw BadInput(file.path().string() + ": grid \"" + file.grids()[place].uniqueName +
                   "\" has NaN or infinite voxels, which other formats cannot be compared with; "
                   "'esvr-compare check' compares such grids");
  return reference;
}

/// The reference and the settings that all rows share.
struct TableScene {
  TableScene(const TableOptions& wanted, const CancelToken& token)
      : options(wanted),
        cancel(token),
        file(options.reference, options.memory),
        place(options.grid ? file.find(*options.grid) : file.firstWithVoxels()),
        reference(readReference(file, place)),
        box(options.box.value_or(activeBox(reference.volume))),
        peak(options.peak.value_or(peakOf(reference.volume))) {
    if (options.images.views > 0)
      gallery.emplace(options.images, reference.volume, selectDevice(options.device), folder.path(),
                      cancel);
  }

  [[nodiscard]] const std::string& gridName() const { return file.grids()[place].uniqueName; }

  const TableOptions& options;
  const CancelToken& cancel;
  const GridFile file;
  const std::size_t place;  ///< of the grid in GridFile::grids
  const VolumeGrid reference;
  const Box box;
  const double peak;
  const ScratchFolder folder;
  std::optional<Gallery> gallery;  ///< nothing: no pictures
};

/// A record without rows.
TableRecord emptyRecord(const TableScene& scene) {
  TableRecord record;
  record.grid = scene.gridName();
  record.referenceBytes = scene.file.bytes();
  record.box = scene.box;
  record.peak = scene.peak;
  record.activeVoxels = activeVoxelCount(scene.reference.volume);
  if (!scene.gallery) return record;
  record.referencePng = scene.gallery->referencePng();
  record.referenceCost = scene.gallery->referenceCost();
  record.drawnOn = deviceName(scene.gallery->device());
  return record;
}

// The baselines.

const char* nameOf(PackedForm form) {
  return cli::wordOf(form, {{"OpenVDB float", PackedForm::kOpenVdbFloat},
                            {"OpenVDB half", PackedForm::kOpenVdbHalf},
                            {"NanoVDB float", PackedForm::kNanoFloat},
                            {"NanoVDB Fp16", PackedForm::kNanoFp16},
                            {"NanoVDB Fp8", PackedForm::kNanoFp8},
                            {"NanoVDB Fp4", PackedForm::kNanoFp4},
                            {"NanoVDB FpN", PackedForm::kNanoFpN}});
}

const char* nameOf(PackedCodec codec) {
  return cli::wordOf(
      codec,
      {{" Zip", PackedCodec::kZip}, {" Blosc", PackedCodec::kBlosc}, {" raw", PackedCodec::kNone}});
}

/// The name of a row: "NanoVDB FpN Zip", "ZFP accuracy".
std::string displayName(const BaselineSetting& setting) {
  if (const auto* packing = std::get_if<VoxelPacking>(&setting.how))
    return std::string(nameOf(packing->form)) + nameOf(packing->codec);
  const auto& zfp = std::get<ZfpSetting>(setting.how);
  const std::string name = zfp.mode == ZfpMode::kAccuracy ? "ZFP accuracy" : "ZFP precision";
  return zfp.bricks ? name + " of bricks" : name;
}

constexpr PackedCodec kNone = PackedCodec::kNone, kZip = PackedCodec::kZip,
                      kBlosc = PackedCodec::kBlosc;
/// The tolerances of FpN in a table: the peak divided by these numbers.
constexpr int kTolerances[] = {1024, 256, 64};

BaselineSetting packed(PackedForm form, PackedCodec codec, double tolerance = 0.0) {
  return {.how = VoxelPacking{form, codec, tolerance}};
}

BaselineSetting zfp(ZfpMode mode, bool bricks = false) {
  return {.how = ZfpSetting{mode, 0.0, bricks}};
}

/// Forms of voxels and of ZFP, as far as the options want them.
std::vector<BaselineSetting> formsOf(const TableOptions& options,
                                     std::vector<BaselineSetting> matched,
                                     const std::vector<BaselineSetting>& ofZfp) {
  std::vector<BaselineSetting> forms;
  if (!options.settings.empty()) return forms;
  if (options.matched) forms = std::move(matched);
  if (options.zfp && !zfpVersion().empty()) forms.insert(forms.end(), ofZfp.begin(), ofZfp.end());
  return forms;
}

/// The baseline to which ratios refer.
BaselineSetting halfBlosc() { return packed(PackedForm::kOpenVdbHalf, kBlosc); }

std::vector<BaselineSetting> losslessSettings() {
  using F = PackedForm;
  return {packed(F::kOpenVdbFloat, kBlosc), packed(F::kOpenVdbFloat, kZip),
          packed(F::kNanoFloat, kNone),     packed(F::kNanoFloat, kZip),
          packed(F::kNanoFloat, kBlosc),    packed(F::kOpenVdbHalf, kBlosc),
          packed(F::kOpenVdbHalf, kZip)};
}

/// Settings and the names of their rows.
std::vector<std::pair<BaselineSetting, std::string>> quantisedSettings(double peak) {
  std::vector<std::pair<BaselineSetting, std::string>> settings;
  const auto add = [&](const BaselineSetting& setting, const std::string& part) {
    std::string name = displayName(setting);
    if (!part.empty()) name.insert(name.rfind(' '), "/" + part);
    settings.emplace_back(setting, name);
  };
  for (const PackedCodec codec : {kNone, kZip}) {
    for (const PackedForm form :
         {PackedForm::kNanoFp16, PackedForm::kNanoFp8, PackedForm::kNanoFp4})
      add(packed(form, codec), "");
    for (const int part : kTolerances)
      add(packed(PackedForm::kNanoFpN, codec, peak / part), std::to_string(part));
  }
  return settings;
}

/// The forms for which the best setting for a size, or for a PSNR, is searched; none if --row names
/// the baselines.
std::vector<BaselineSetting> sizeForms(const TableOptions& options) {
  using F = PackedForm;
  return formsOf(options,
                 {packed(F::kOpenVdbHalf, kBlosc), packed(F::kNanoFloat, kZip),
                  packed(F::kNanoFp16, kZip), packed(F::kNanoFp8, kZip), packed(F::kNanoFp4, kZip),
                  packed(F::kNanoFpN, kZip), packed(F::kNanoFpN, kNone)},
                 {zfp(ZfpMode::kAccuracy), zfp(ZfpMode::kPrecision)});
}

std::vector<BaselineSetting> psnrForms(const TableOptions& options) {
  return formsOf(options, {packed(PackedForm::kNanoFpN, kZip)},
                 {zfp(ZfpMode::kAccuracy), zfp(ZfpMode::kPrecision)});
}

/// Forms that are matched to a PSNR over the active voxels.
std::vector<BaselineSetting> activePsnrForms(const TableOptions& options) {
  return formsOf(options, {packed(PackedForm::kNanoFpN, kZip), packed(PackedForm::kNanoFp4, kZip)},
                 {zfp(ZfpMode::kAccuracy), zfp(ZfpMode::kAccuracy, true)});
}

// The measurement.

TableRow withNote(TableRow row, const std::string& note) {
  row.note = note;
  return row;
}

/// Runs once to warm up and then `runs` times. \return the statistics of the seconds of these
template <class Run>
Timing timed(int runs, const Run& run) {
  (void)run();
  std::vector<double> seconds;
  for (int i = 0; i < runs; ++i) seconds.push_back(run());
  std::sort(seconds.begin(), seconds.end());
  const std::size_t n = seconds.size();
  return {(seconds[(n - 1) / 2] + seconds[n / 2]) / 2, seconds.front(), seconds.back(), int(n)};
}

Timing once(double seconds) { return {seconds, seconds, seconds, 1}; }

std::string settingOf(double bound) { return "bound=" + cli::exactNumber(bound); }

SearchStep stepOf(std::string setting, std::uint64_t bytes, double psnr) {
  return {std::move(setting), bytes, std::isnan(psnr) ? std::nullopt : std::optional(psnr)};
}

/// Index in EsvrFile::grids of the grid that has the reference's name; if only one grid of a file
/// is not carried, it is taken.
std::size_t placeOf(const EsvrFile& file, const std::filesystem::path& path,
                    const std::string& name) {
  return file.grids.size() == 1 ? 0 : findStored(file, name, path);
}

StoredGrid gridOf(EsvrFile file, const std::filesystem::path& path, const std::string& name) {
  return std::move(file.grids[placeOf(file, path, name)]);
}

void requireOverlap(const std::filesystem::path& path, const Box& a, const Box& b) {
  if (!b.empty() && common(a, b).empty())
    throw BadInput(path.string() +
                   ": its active voxels and the reference's lie in boxes that do not meet");
}

/// The curve of a fit, whose PSNR has the source's peak, with the peak of all rows.
std::vector<TimedCurvePoint> withPeak(std::vector<TimedCurvePoint> curve, const TableScene& scene) {
  const double more = 20.0 * std::log10(scene.peak / peakOf(scene.reference.volume));
  for (auto& point : curve) {
    point.psnrBox += more;
    point.psnrActive += more;
  }
  return curve;
}

std::string groupOf(const RowGoal& goal) {
  if (const auto* bytes = std::get_if<std::uint64_t>(&goal))
    return "at " + std::to_string(*bytes) + " bytes";
  const auto& [psnr, active, dropsVoxels] = std::get<MatchGoal>(goal);
  return "at " + cli::decibels(psnr) + (active ? " dB over active voxels" : " dB");
}

/// A row without figures. A row of the same PSNR over the box stands beside the file of ESVR that has
/// it.
TableRow rowFor(const RowGoal& goal, const std::string& name) {
  TableRow row{.name = name, .group = groupOf(goal)};
  if (const auto* bytes = std::get_if<std::uint64_t>(&goal)) row.matchedBytes = *bytes;
  if (const auto* wanted = std::get_if<MatchGoal>(&goal); wanted && !wanted->active)
    row.matchedPsnr = wanted->psnr;
  return row;
}

/// A fit that a row is to show.
struct FitWish {
  std::optional<std::uint64_t> bytes{};  ///< size of the file; nothing: default options
  bool paper = false;                    ///< whether the paper's method is used, stored as float32
};

/// Makes one row after the other.
class RowMaker {
 public:
  explicit RowMaker(const TableScene& scene)
      : scene_(scene),
        options_(scene.options),
        volume_(scene.reference.volume),
        encoder_({.grid = scene.reference,
                  .box = scene.box,
                  .peak = scene.peak,
                  .folder = scene.folder.path(),
                  .maxDenseBytes = options_.maxDense,
                  .cancel = &scene.cancel}) {}

  /// \throws BadInput  the candidate does not have the grid, or its voxels lie elsewhere
  TableRow candidate(const std::filesystem::path& path) {
    TableRow row{.name = path.filename().string(), .group = kOurGroup};
    const GridFile file(path, options_.memory);
    if (!file.esvr())
      throw BadInput(path.string() +
                     ": candidates must be .esvr files; --external takes other results");
    const std::size_t place = placeOf(*file.esvr(), path, scene_.gridName());
    row.bytes =
        file.grids().size() == 1 ? file.bytes() : cli::storedBytes(inspectEsvr(path), place);
    row.command = command(cli::shellWord(path.string()) + " --rows none");
    measureEsvr(path, row);
    return row;
  }

  TableRow external(const External& external) {
    TableRow row{.name = external.name, .group = kExternalGroup};
    row.command = "--external " + cli::shellWord(external.text);
    row.bytes = external.bytes;
    if (external.encodeSeconds) row.encode = once(*external.encodeSeconds);
    if (external.decodeSeconds) row.decode = once(*external.decodeSeconds);
    row.note = "times as given";
    measureVoxels(readExternal(external, {scene_.gridName(), scene_.box, volume_.background,
                                          options_.memory}),
                  NanoValues::kFloat, row);
    if (external.fps) row.fps = external.fps;
    return row;
  }

  /// Fits ellipsoids.
  TableRow fitted(const FitWish& wish) {
    const std::string word =  // the value of --fit
        wish.paper   ? "paper"
        : wish.bytes ? std::to_string(*wish.bytes)
                     : "default";
    TableRow row{.name = "ESVR fitted, " + word, .group = kOurGroup, .fittedHere = true};
    row.command = command("--rows none --fit " + word);
    const auto path = scene_.folder.path() / "fitted.esvr";

    const cli::MemoryMeter encoding;
    cli::Stopwatch watch;
    EsvrFile file;
    file.metadata = scene_.file.metadata();
    const std::uint64_t head = bytesBesideGrids(file.metadata);
    if (wish.bytes && *wish.bytes <= head)
      throw UsageError("--fit " + word + " is too small for a grid");
    Conversion conversion = convert(wish, head);
    row.curve = withPeak(std::move(conversion.fit.curve), scene_);
    file.grids.push_back(std::move(conversion.grid));
    row.bytes = writeEsvr(path, file, {.overwrite = true});
    row.encode = once(watch.lap());
    if (scene_.cancel.cancelled()) throw Cancelled();
    row.note = "one fit, on " + deviceName(selectDevice(options_.device));
    const auto memory = encoding.peakRise();
    measureEsvr(path, row);
    row.memory = std::max(row.memory, memory);
    return row;
  }

  /// If the row cannot be made, its note has the reason. \throws Cancelled  the run was interrupted
  TableRow baseline(const std::string& group, const BaselineSetting& setting,
                    const std::string& name) try {
    TableRow row{.name = name, .group = group};
    measure(setting, row);
    return row;
  } catch (const UsageError& error) {
    return {.name = name, .group = group, .note = error.what()};
  }

  /// Searches the best setting of the form of `like` for a goal.
  TableRow matched(const BaselineSetting& like, const RowGoal& goal) {
    TableRow row = rowFor(goal, displayName(like));
    const TableRow plain = row;
    try {
      const auto* bytes = std::get_if<std::uint64_t>(&goal);
      const Match match = bytes ? matchSize(encoder_, like, *bytes)
                                : matchPsnr(encoder_, like, std::get<MatchGoal>(goal));
      for (const auto& step : match.steps)
        row.search.push_back(stepOf(toString(step.setting), step.bytes, step.psnr));
      if (match.found)
        measure(match.best.setting, row);
      else
        row.note = "out of reach";
      return row;
    } catch (const UsageError& error) {
      return withNote(plain, error.what());
    }
  }

  /// Searches the best bound of an external command for a goal.
  TableRow matched(const ExternalCommand& external, const RowGoal& goal) {
    TableRow row = rowFor(goal, external.name);
    if (row.matchedBytes)
      row.command = command("--rows none --size " + std::to_string(*row.matchedBytes) +
                            " --external-command " + cli::shellWord(external.text));
    const TableRow plain = row;
    try {
      ExternalCodec codec(external, {.volume = volume_,
                                     .box = scene_.box,
                                     .peak = scene_.peak,
                                     .folder = scene_.folder.path(),
                                     .maxDense = options_.maxDense,
                                     .memory = options_.memory,
                                     .cancel = &scene_.cancel});
      const ExternalMatch found = match(codec, goal);
      for (const auto& step : found.steps)
        row.search.push_back(stepOf(settingOf(step.bound), step.bytes, step.psnr));
      if (found.found)
        measure(codec, found.best.bound, row);
      else
        row.note = "out of reach";
      return row;
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      if (scene_.cancel.cancelled()) throw Cancelled();  // Ctrl-C also ends the command
      return withNote(plain, error.what());
    }
  }

 private:
  void measure(const BaselineSetting& setting, TableRow& row) {
    row.setting = toString(setting);
    row.command = command("--row " + cli::shellWord(row.setting));
    row.bytes = encoder_.encode(setting).bytes;  // also builds the method's input, not timed below
    const cli::MemoryMeter encoding;
    row.encode = timed(options_.runs, [&] { return encoder_.encode(setting).seconds; });
    row.memory = encoding.peakRise();
    const cli::MemoryMeter decoding;
    row.decode = timed(options_.runs, [&] { return encoder_.secondsToDecode(); });
    row.memory = std::max(row.memory, decoding.peakRise());
    const auto* packing = std::get_if<VoxelPacking>(&setting.how);
    measureVoxels(encoder_.decode(), packing ? nanoValues(packing->form) : NanoValues::kFloat, row);
  }

  void measure(ExternalCodec& codec, double bound, TableRow& row) {
    row.setting = settingOf(bound);
    row.bytes = codec.encode(bound).bytes;
    row.encode = timed(options_.runs, [&] { return codec.encode(bound).seconds; });
    row.decode = timed(options_.runs, [&] { return codec.secondsToDecode(); });
    row.note = "times of the whole command";
    measureVoxels(codec.decode(), NanoValues::kFloat, row);
  }

  void measureEsvr(const std::filesystem::path& path, TableRow& row) {
    const cli::HostMemory& memory = options_.memory;
    SparseVolume volume;
    const cli::MemoryMeter decoding;
    row.decode = timed(options_.runs, [&] {
      cli::Stopwatch watch;
      volume = decodeGrid(
          gridOf(readEsvr(path, {memory.maxBytes, memory.voxels}), path, scene_.gridName()),
          {.maxBytes = memory.maxBytes, .memory = memory.voxels});
      return watch.lap();
    });
    row.memory = decoding.peakRise();
    requireOverlap(path, activeBox(volume_), activeBox(volume));
    row.metrics = compare(volume);
    if (scene_.gallery)
      drawEsvr(gridOf(readEsvr(path, {memory.maxBytes, memory.voxels}), path, scene_.gridName()),
               volume, row);
  }

  void drawEsvr(const StoredGrid& grid, const SparseVolume& voxels, TableRow& row) const {
    const Device& device = scene_.gallery->device();
    if (!followsFromEllipsoids(grid))
      return measurePictures(*makeVolumeRenderer(voxels, device), row);
    measurePictures(*makeFieldRenderer(grid.field, device, {}, voxelRule(grid)), row);
  }

  void measureVoxels(const SparseVolume& volume, NanoValues values, TableRow& row) const {
    row.metrics = compare(volume);
    if (!scene_.gallery) return;
    measurePictures(*makeVoxelRenderer(volume, values, scene_.gallery->device()), row);
  }

  void measurePictures(Renderer& renderer, TableRow& row) const {
    auto compared = scene_.gallery->compare(renderer);
    row.images = compared.figures;
    row.shown = std::move(compared.shown);
    row.fps = compared.figures.fps;
  }

  VolumeMetrics compare(const SparseVolume& volume) const {
    return compareVolumes(
        volume_, volume,
        {.box = scene_.box,
         .peak = scene_.peak,
         .ssim = true,
         .transmittance = isLookedThrough(scene_.reference.descriptor.gridClass, volume_)});
  }

  std::string command(const std::string& arguments) const {
    const TableOptions& o = options_;
    std::string text = std::string(kProgram) + " table " + cli::shellWord(o.reference.string());
    if (o.grid) text += " -g " + cli::shellWord(*o.grid);
    if (o.box) {
      const Coord a = o.box->min, b = o.box->max;
      text += " --box";
      for (const int side : {a.x, a.y, a.z, b.x, b.y, b.z})
        text += (text.ends_with("box") ? " " : ",") + std::to_string(side);
    }
    if (o.peak) text += " --peak " + std::to_string(*o.peak);
    return text + " " + arguments;
  }

  Conversion convert(const FitWish& wish, std::uint64_t head) const {
    ConvertOptions options;
    options.representation = Representation::kEllipsoids;  // the row is that of a fit
    options.fit.box = scene_.box;
    options.fit.cancel = &scene_.cancel;
    options.fit.device = selectDevice(options_.device);
    const ConvertInput input{scene_.reference.descriptor, volume_};
    if (wish.paper)
      return convertByPaper(input, {options.fit, {}}, {.form = Storage::kFloat32}).conversion;
    options.measure =
        Measure::kValues;  // the rows of rivals are matched by the PSNR of values, too
    if (wish.bytes) options.goal = SizeGoal{*wish.bytes - head};
    return convertVolume(input, options);
  }

  const TableScene& scene_;
  const TableOptions& options_;
  const SparseVolume& volume_;  ///< of the reference
  BaselineEncoder encoder_;
};

// The rows in their order.

/// Makes one row after the other. Finished rows are kept if the run is interrupted.
class TableRun {
 public:
  TableRun(const TableScene& scene, TableRecord& record, const cli::Log& log)
      : cancel_(scene.cancel),
        peak_(scene.peak),
        options_(scene.options),
        record_(record),
        log_(log),
        maker_(scene) {}

  void run() try {
    record_.halfBlosc = maker_.baseline("", halfBlosc(), "").bytes;
    for (const auto& path : options_.candidates) add(maker_.candidate(path));
    for (const auto& external : options_.externals) add(maker_.external(external));
    if (options_.fitDefault) add(maker_.fitted({}));
    if (options_.fitPaper) add(maker_.fitted({.paper = true}));
    for (const std::uint64_t bytes : options_.fits) add(maker_.fitted({.bytes = bytes}));
    for (const auto& setting : options_.settings) addBaseline("given", setting);
    if (options_.settings.empty()) plainRows();
    matchedRows();
  } catch (const Cancelled&) {
    record_.interrupted = true;
  }

 private:
  void add(TableRow row) {
    if (cancel_.cancelled()) throw Cancelled();
    log_.detail("made " + row.group + ": " + row.name);
    record_.rows.push_back(std::move(row));
  }

  void addBaseline(const std::string& group, const BaselineSetting& setting) {
    add(maker_.baseline(group, setting, displayName(setting)));
  }

  void plainRows() {
    if (options_.lossless)
      for (const auto& setting : losslessSettings()) addLossless(setting);
    if (options_.quantised)
      for (const auto& [setting, name] : quantisedSettings(peak_))
        add(maker_.baseline(kQuantisedGroup, setting, name));
  }

  /// Half floats have an error unless the values are half floats themselves.
  void addLossless(const BaselineSetting& setting) {
    TableRow row = maker_.baseline(kLosslessGroup, setting, displayName(setting));
    if (row.metrics && row.metrics->maxError > 0.0) row.group = kNearlyLosslessGroup;
    add(std::move(row));
  }

  void matchedRows() {
    std::set<std::uint64_t> sizes(options_.sizes.begin(), options_.sizes.end());
    std::set<double> psnrs(options_.psnrs.begin(), options_.psnrs.end());
    for (const auto& row : record_.rows) {
      if (row.group != kOurGroup) continue;
      sizes.insert(*row.bytes);
      if (std::isfinite(row.metrics->psnrBox)) psnrs.insert(row.metrics->psnrBox);
    }
    for (const std::uint64_t bytes : sizes) addMatched(sizeForms(options_), bytes);
    for (const double psnr : psnrs) addMatched(psnrForms(options_), MatchGoal{.psnr = psnr});
    for (const double psnr : options_.activePsnrs)
      addMatched(activePsnrForms(options_),
                 MatchGoal{.psnr = psnr, .active = true, .dropsVoxels = true});
  }

  void addMatched(const std::vector<BaselineSetting>& forms, const RowGoal& goal) {
    for (const auto& form : forms) add(maker_.matched(form, goal));
    for (const auto& command : options_.commands) add(maker_.matched(command, goal));
  }

  const CancelToken& cancel_;
  const double peak_;
  const TableOptions& options_;
  TableRecord& record_;
  const cli::Log& log_;
  RowMaker maker_;
};

}  // namespace

TableRecord makeRows(const TableOptions& options, const CancelToken& cancel, const cli::Log& log) {
  const TableScene scene(options, cancel);
  TableRecord record = emptyRecord(scene);
  if (options.zfp && zfpVersion().empty())
    log.warning("this build has no ZFP; the table has no rows for it");
  TableRun(scene, record, log).run();
  return record;
}

}  // namespace esvr::compare
