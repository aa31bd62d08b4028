#include "compare/rows.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "compare/options.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/fit.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "programs/option_values.h"
#include "programs/resources.h"
#include "programs/run_main.h"

namespace esvr::compare {

// The reference.

ScratchFolder::ScratchFolder() {
  std::string pattern = cli::scratchFolder() / "esvr-compare-XXXXXX";
  if (mkdtemp(pattern.data()) == nullptr)
    throw RuntimeFailure("cannot make a temporary folder with the pattern " + pattern);
  path_ = pattern;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

namespace {

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

}  // namespace

SceneFiles::SceneFiles(const TableOptions& options, const CancelToken& cancel)
    : options_(options),
      cancel_(cancel),
      file_(options.reference, options.memory),
      place_(options.grid ? file_.find(*options.grid) : file_.firstWithVoxels()),
      reference_(readReference(file_, place_)),
      box_(options.box.value_or(activeBox(reference_.volume))),
      peak_(options.peak.value_or(peakOf(reference_.volume))) {
  if (options.images.views > 0)
    gallery_.emplace(options.images, reference_.volume, selectDevice(options.device),
                     folder_.path(), cancel);
}

TableScene SceneFiles::scene() const {
  return {options_,
          file_.grids()[place_].uniqueName,
          reference_,
          file_.metadata(),
          box_,
          peak_,
          folder_.path(),
          cancel_,
          gallery_ ? &*gallery_ : nullptr};
}

TableRecord SceneFiles::record() const {
  TableRecord record;
  record.grid = file_.grids()[place_].uniqueName;
  record.referenceBytes = file_.bytes();
  record.box = box_;
  record.peak = peak_;
  record.activeVoxels = activeVoxelCount(reference_.volume);
  if (!gallery_) return record;
  record.referencePng = gallery_->referencePng();
  record.referenceCost = gallery_->referenceCost();
  record.drawnOn = deviceName(gallery_->device());
  return record;
}

// The baselines.

namespace {

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

}  // namespace

std::string displayName(const BaselineSetting& setting) {
  if (const auto* packing = std::get_if<VoxelPacking>(&setting.how))
    return std::string(nameOf(packing->form)) + nameOf(packing->codec);
  const auto& zfp = std::get<ZfpSetting>(setting.how);
  const std::string name = zfp.mode == ZfpMode::kAccuracy ? "ZFP accuracy" : "ZFP precision";
  return zfp.bricks ? name + " of bricks" : name;
}

namespace {

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

}  // namespace

BaselineSetting halfBlosc() { return packed(PackedForm::kOpenVdbHalf, kBlosc); }

std::vector<BaselineSetting> losslessSettings() {
  using F = PackedForm;
  return {packed(F::kOpenVdbFloat, kBlosc), packed(F::kOpenVdbFloat, kZip),
          packed(F::kNanoFloat, kNone),     packed(F::kNanoFloat, kZip),
          packed(F::kNanoFloat, kBlosc),    packed(F::kOpenVdbHalf, kBlosc),
          packed(F::kOpenVdbHalf, kZip)};
}

std::vector<NamedSetting> quantisedSettings(double peak) {
  std::vector<NamedSetting> settings;
  const auto add = [&](const BaselineSetting& setting, const std::string& part) {
    std::string name = displayName(setting);
    if (!part.empty()) name.insert(name.rfind(' '), "/" + part);
    settings.push_back({setting, name});
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

std::vector<BaselineSetting> activePsnrForms(const TableOptions& options) {
  return formsOf(options, {packed(PackedForm::kNanoFpN, kZip), packed(PackedForm::kNanoFp4, kZip)},
                 {zfp(ZfpMode::kAccuracy), zfp(ZfpMode::kAccuracy, true)});
}

// The measurement.

namespace {

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

std::string sizeGroup(std::uint64_t bytes) { return "at " + std::to_string(bytes) + " bytes"; }
std::string psnrGroup(const MatchGoal& goal) {
  return "at " + cli::decibels(goal.psnr) + (goal.active ? " dB over active voxels" : " dB");
}

/// The PSNR of a file of ESVR, beside which a row of the same PSNR over the box stands.
std::optional<double> psnrOverBoxOf(const MatchGoal& goal) {
  return goal.active ? std::nullopt : std::optional(goal.psnr);
}

}  // namespace

RowMaker::RowMaker(const TableScene& scene)
    : scene_(scene),
      encoder_({.grid = scene.reference,
                .box = scene.box,
                .peak = scene.peak,
                .folder = scene.folder,
                .maxDenseBytes = scene.options.maxDense,
                .cancel = &scene.cancel}) {}

VolumeMetrics RowMaker::compare(const SparseVolume& volume) const {
  return compareVolumes(scene_.reference.volume, volume,
                        {.box = scene_.box,
                         .peak = scene_.peak,
                         .ssim = true,
                         .transmittance = isLookedThrough(scene_.reference.descriptor.gridClass,
                                                          scene_.reference.volume)});
}

void RowMaker::measurePictures(Renderer& renderer, TableRow& row) const {
  auto compared = scene_.gallery->compare(renderer);
  row.images = compared.figures;
  row.shown = std::move(compared.shown);
  row.fps = compared.figures.fps;
}

void RowMaker::measureVoxels(const SparseVolume& volume, NanoValues values, TableRow& row) const {
  row.metrics = compare(volume);
  if (!scene_.gallery) return;
  measurePictures(*makeVoxelRenderer(volume, values, scene_.gallery->device()), row);
}

std::string RowMaker::command(const std::string& arguments) const {
  const TableOptions& o = scene_.options;
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

void RowMaker::measure(const BaselineSetting& setting, TableRow& row) {
  row.setting = toString(setting);
  row.command = command("--row " + cli::shellWord(row.setting));
  row.bytes = encoder_.encode(setting).bytes;  // also builds the method's input, not timed below
  const cli::MemoryMeter encoding;
  row.encode = timed(scene_.options.runs, [&] { return encoder_.encode(setting).seconds; });
  row.memory = encoding.peakRise();
  const cli::MemoryMeter decoding;
  row.decode = timed(scene_.options.runs, [&] { return encoder_.secondsToDecode(); });
  row.memory = std::max(row.memory, decoding.peakRise());
  const auto* packing = std::get_if<VoxelPacking>(&setting.how);
  measureVoxels(encoder_.decode(), packing ? nanoValues(packing->form) : NanoValues::kFloat, row);
}

TableRow RowMaker::baseline(const std::string& group, const BaselineSetting& setting,
                            const std::string& name) try {
  TableRow row{.name = name, .group = group};
  measure(setting, row);
  return row;
} catch (const UsageError& error) {
  return {.name = name, .group = group, .note = error.what()};
}

TableRow RowMaker::matched(const BaselineSetting& like, const std::string& group,
                           const std::function<Match()>& search) try {
  TableRow row{.name = displayName(like), .group = group};
  const Match match = search();
  for (const auto& step : match.steps)
    row.search.push_back(stepOf(toString(step.setting), step.bytes, step.psnr));
  if (match.found)
    measure(match.best.setting, row);
  else
    row.note = "out of reach";
  return row;
} catch (const UsageError& error) {
  return {.name = displayName(like), .group = group, .note = error.what()};
}

TableRow RowMaker::sizeMatched(const BaselineSetting& like, std::uint64_t bytes) {
  TableRow row = matched(like, sizeGroup(bytes), [&] { return matchSize(encoder_, like, bytes); });
  row.matchedBytes = bytes;
  return row;
}

TableRow RowMaker::psnrMatched(const BaselineSetting& like, const MatchGoal& goal) {
  TableRow row = matched(like, psnrGroup(goal), [&] { return matchPsnr(encoder_, like, goal); });
  row.matchedPsnr = psnrOverBoxOf(goal);
  return row;
}

TableRow RowMaker::external(const External& external) {
  TableRow row{.name = external.name, .group = kExternalGroup};
  row.command = "--external " + cli::shellWord(external.text);
  row.bytes = external.bytes;
  if (external.encodeSeconds) row.encode = once(*external.encodeSeconds);
  if (external.decodeSeconds) row.decode = once(*external.decodeSeconds);
  row.note = "times as given";
  measureVoxels(readExternal(external, {scene_.gridName, scene_.box,
                                        scene_.reference.volume.background, scene_.options.memory}),
                NanoValues::kFloat, row);
  if (external.fps) row.fps = external.fps;
  return row;
}

void RowMaker::measure(ExternalCodec& codec, double bound, TableRow& row) {
  row.setting = settingOf(bound);
  row.bytes = codec.encode(bound).bytes;
  row.encode = timed(scene_.options.runs, [&] { return codec.encode(bound).seconds; });
  row.decode = timed(scene_.options.runs, [&] { return codec.secondsToDecode(); });
  row.note = "times of the whole command";
  measureVoxels(codec.decode(), NanoValues::kFloat, row);
}

TableRow RowMaker::matched(const ExternalCommand& command, const TableRow& like,
                           const std::function<ExternalMatch(ExternalCodec&)>& search) try {
  TableRow row = like;
  ExternalCodec codec(command, {.volume = scene_.reference.volume,
                                .box = scene_.box,
                                .peak = scene_.peak,
                                .folder = scene_.folder,
                                .maxDense = scene_.options.maxDense,
                                .memory = scene_.options.memory,
                                .cancel = &scene_.cancel});
  const ExternalMatch match = search(codec);
  for (const auto& step : match.steps)
    row.search.push_back(stepOf(settingOf(step.bound), step.bytes, step.psnr));
  if (match.found)
    measure(codec, match.best.bound, row);
  else
    row.note = "out of reach";
  return row;
} catch (const Cancelled&) {
  throw;
} catch (const Error& error) {
  if (scene_.cancel.cancelled()) throw Cancelled();  // Ctrl-C also ends the command
  TableRow row = like;
  row.note = error.what();
  return row;
}

TableRow RowMaker::sizeMatched(const ExternalCommand& external, std::uint64_t bytes) {
  const std::string size = std::to_string(bytes);
  return matched(external,
                 {.name = external.name,
                  .group = sizeGroup(bytes),
                  .command = command("--rows none --size " + size + " --external-command " +
                                     cli::shellWord(external.text)),
                  .matchedBytes = bytes},
                 [=](ExternalCodec& codec) { return matchSize(codec, bytes); });
}

TableRow RowMaker::psnrMatched(const ExternalCommand& external, const MatchGoal& goal) {
  return matched(
      external,
      {.name = external.name, .group = psnrGroup(goal), .matchedPsnr = psnrOverBoxOf(goal)},
      [=](ExternalCodec& codec) { return matchPsnr(codec, goal); });
}

void RowMaker::measureEsvr(const std::filesystem::path& path, TableRow& row) {
  const cli::HostMemory& memory = scene_.options.memory;
  SparseVolume volume;
  const cli::MemoryMeter decoding;
  row.decode = timed(scene_.options.runs, [&] {
    cli::Stopwatch watch;
    volume =
        decodeGrid(gridOf(readEsvr(path, {memory.maxBytes, memory.voxels}), path, scene_.gridName),
                   {.maxBytes = memory.maxBytes, .memory = memory.voxels});
    return watch.lap();
  });
  row.memory = decoding.peakRise();
  requireOverlap(path, activeBox(scene_.reference.volume), activeBox(volume));
  row.metrics = compare(volume);
  if (scene_.gallery)
    drawEsvr(gridOf(readEsvr(path, {memory.maxBytes, memory.voxels}), path, scene_.gridName),
             volume, row);
}

void RowMaker::drawEsvr(const StoredGrid& grid, const SparseVolume& voxels, TableRow& row) const {
  const Device& device = scene_.gallery->device();
  if (!followsFromEllipsoids(grid))
    return measurePictures(*makeVolumeRenderer(voxels, device), row);
  measurePictures(*makeFieldRenderer(grid.field, device, {}, voxelRule(grid)), row);
}

TableRow RowMaker::candidate(const std::filesystem::path& path) {
  TableRow row{.name = path.filename().string(), .group = kOurGroup};
  const GridFile file(path, scene_.options.memory);
  if (!file.esvr())
    throw BadInput(path.string() +
                   ": candidates must be .esvr files; --external takes other results");
  const std::size_t place = placeOf(*file.esvr(), path, scene_.gridName);
  row.bytes = file.grids().size() == 1 ? file.bytes() : cli::storedBytes(inspectEsvr(path), place);
  row.command = command(cli::shellWord(path.string()) + " --rows none");
  measureEsvr(path, row);
  return row;
}

Conversion RowMaker::convert(const FitWish& wish, std::uint64_t head) const {
  ConvertOptions options;
  options.representation = Representation::kEllipsoids;  // the row is that of a fit
  options.fit.box = scene_.box;
  options.fit.cancel = &scene_.cancel;
  options.fit.device = selectDevice(scene_.options.device);
  const ConvertInput input{scene_.reference.descriptor, scene_.reference.volume};
  if (wish.paper)
    return convertByPaper(input, {options.fit, {}}, {.form = Storage::kFloat32}).conversion;
  options.measure = Measure::kValues;  // the rows of rivals are matched by the PSNR of values, too
  if (wish.bytes) options.goal = SizeGoal{*wish.bytes - head};
  return convertVolume(input, options);
}

TableRow RowMaker::fitted(const FitWish& wish) {
  const std::string word =  // the value of --fit
      wish.paper   ? "paper"
      : wish.bytes ? std::to_string(*wish.bytes)
                   : "default";
  TableRow row{.name = "ESVR fitted, " + word, .group = kOurGroup, .fittedHere = true};
  row.command = command("--rows none --fit " + word);
  const auto path = scene_.folder / "fitted.esvr";

  const cli::MemoryMeter encoding;
  cli::Stopwatch watch;
  EsvrFile file;
  file.metadata = scene_.metadata;
  const std::uint64_t head = bytesBesideGrids(file.metadata);
  if (wish.bytes && *wish.bytes <= head)
    throw UsageError("--fit " + word + " is too small for a grid");
  Conversion conversion = convert(wish, head);
  row.curve = withPeak(std::move(conversion.fit.curve), scene_);
  file.grids.push_back(std::move(conversion.grid));
  row.bytes = writeEsvr(path, file, {.overwrite = true});
  row.encode = once(watch.lap());
  if (scene_.cancel.cancelled()) throw Cancelled();
  row.note = "one fit, on " + deviceName(selectDevice(scene_.options.device));
  const auto memory = encoding.peakRise();
  measureEsvr(path, row);
  row.memory = std::max(row.memory, memory);
  return row;
}

}  // namespace esvr::compare
