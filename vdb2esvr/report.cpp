// The JSON reports of --report: what was asked for, the grids, a run, and a sequence.
#include "vdb2esvr/records.h"

#include <nlohmann/json.hpp>
#include <optional>

#include "esvr/grid.h"
#include "esvr/volume.h"
#include "programs/command_line.h"
#include "programs/files.h"
#include "programs/option_values.h"
#include "programs/resources.h"

namespace esvr::vdb2esvr {
namespace {

using Json = nlohmann::ordered_json;

template <class T>
Json orNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

/// The first and the last voxel of a box: x, y, z, x, y, z. Null if it is empty.
Json toJson(const Box& box) {
  if (box.empty()) return nullptr;
  return {box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z};
}

// What was asked for.

/// A member of a goal of a kind; null if the goal is of another kind.
template <class Kind, class Member>
Json memberOf(const Goal& goal, Member Kind::*member) {
  const auto* wanted = std::get_if<Kind>(&goal);
  return wanted ? Json(wanted->*member) : Json(nullptr);
}

bool isShare(const Goal& goal) {
  const auto* within = std::get_if<BoundGoal>(&goal);
  return within && within->relative;
}

/// The magnitude below which a bound relative to each value does not fall.
Json relativeFloorOf(const Goal& goal) {
  const auto* within = std::get_if<RelativeBoundGoal>(&goal);
  return within ? orNull(within->floor) : Json(nullptr);
}

/// The goals of single grids.
Json goalsOf(const std::vector<GridGoal>& goals) {
  Json list = Json::array();
  for (const GridGoal& own : goals)
    list.push_back({{"grid", own.grid},
                    {"psnr", memberOf(own.goal, &PsnrGoal::psnr)},
                    {"max_error", memberOf(own.goal, &BoundGoal::bound)},
                    {"max_error_is_share", isShare(own.goal)}});
  return list;
}

/// By what the goal of a grid was measured.
const char* measureOf(const Conversion& conversion) {
  if (conversion.surfaceBound) return "surface";
  return conversion.byPictures ? "pictures" : "values";
}

/// The tone curve that was asked for.
Json toneJson(const std::optional<ToneCurve>& tone) {
  if (!tone) return "auto";
  return tone->isOn() ? Json(tone->scale) : Json("off");
}

/// What becomes of voxels that are NaN or infinite.
Json nonFiniteJson(const ReadOptions& read) {
  if (read.nonFinite == NonFinite::kValue) return read.nonFiniteValue;
  return cli::wordOf(read.nonFinite, {{"refuse", NonFinite::kRefuse},
                                      {"keep", NonFinite::kKeep},
                                      {"background", NonFinite::kBackground}});
}

}  // namespace

Json askedJson(const Options& options) {
  const FitOptions& fit = options.convert.fit;
  const StorageOptions& storage = options.convert.storage;
  return {{"count", orNull(fit.count)},
          {"psnr", orNull(options.psnr)},
          {"picture_psnr", orNull(options.picturePsnr)},
          {"measure", cli::wordOf(options.convert.measure, kMeasures)},
          {"tone", toneJson(options.convert.tone)},
          {"size", orNull(options.size)},
          {"ratio", orNull(options.ratio)},
          {"lossless", std::holds_alternative<LosslessGoal>(options.convert.goal)},
          {"max_error", memberOf(options.convert.goal, &BoundGoal::bound)},
          {"max_error_is_share", isShare(options.convert.goal)},
          {"max_relative_error", memberOf(options.convert.goal, &RelativeBoundGoal::share)},
          {"relative_floor", relativeFloorOf(options.convert.goal)},
          {"representation", cli::wordOf(options.convert.representation, kRepresentations)},
          {"goals", goalsOf(options.gridGoals)},
          {"share", cli::wordOf(options.shares, kShares)},
          {"seconds", orNull(fit.seconds)},
          {"iterations", orNull(fit.iterations)},
          {"method", options.paper ? "paper" : "default"},
          {"preset", cli::wordOf(fit.preset, kPresets)},
          {"effort", options.convert.effort},
          {"box", fit.box ? toJson(*fit.box) : Json(nullptr)},
          {"storage", cli::wordOf(storage.form, kStorages)},
          {"topology", cli::wordOf(storage.activity, kActivities)},
          {"keep", options.grids.keep},
          {"skip", options.grids.skip},
          {"nonfinite", nonFiniteJson(options.read)},
          {"seed", fit.seed},
          {"threads", options.threads > 0 ? Json(options.threads) : Json(nullptr)},
          {"device", options.device},
          {"max_vram", orNull(fit.maxDeviceBytes)},
          {"chunk_voxels", orNull(fit.chunkVoxels)}};
}

// A grid.

namespace {

const char* nameOf(FitEnd end) {
  return cli::wordOf(end, {{"schedule done", FitEnd::kScheduleDone},
                           {"psnr reached", FitEnd::kPsnrReached},
                           {"time up", FitEnd::kTimeUp},
                           {"interrupted", FitEnd::kCancelled},
                           {"psnr missed", FitEnd::kPsnrMissed}});
}

/// The inactive values that the file does not hold; null if there is none.
Json inactiveOf(const InactiveValues& values) {
  if (values.count() == 0) return nullptr;
  const bool hasRange = values.count() > values.nonFinite();
  return {{"count", values.count()},
          {"value_range", hasRange ? Json{values.min(), values.max()} : Json(nullptr)},
          {"nonfinite", values.nonFinite()}};
}

/// The voxels that are not finite and come back so; null if there is none.
Json keptOf(const RunRecord& record, std::size_t g) {
  const NonFiniteCounts& kept = record.grids[g].stored().nonFinite;
  if (kept.total() == 0) return nullptr;
  return {{"nan", kept.nan},
          {"plus_infinity", kept.plusInfinity},
          {"minus_infinity", kept.minusInfinity},
          {"bytes", bytesOf(record.output, g, "non-finite voxels")}};
}

Json sourceOf(const RunRecord& record, std::size_t g) {
  const ConvertedGrid& grid = record.grids[g];
  const StoredGrid& stored = grid.stored();
  return {{"class", className(stored.descriptor.gridClass)},
          {"value_type", cli::nameOf(stored.descriptor.valueType)},
          {"background", stored.descriptor.background},
          {"map", stored.descriptor.transform.mapType},
          {"active_voxels", stored.activeVoxels},
          {"active_box", toJson(stored.activeBox)},
          {"bricks", grid.bricks},
          {"value_range", {stored.valueMin, stored.valueMax}},
          {"nonfinite_replaced", grid.nonFiniteReplaced},
          {"nonfinite_kept", keptOf(record, g)},
          {"inactive_lost", inactiveOf(grid.inactive)}};
}

Json kernelOf(const Kernel& kernel) {
  return {{"form", cli::nameOf(kernel.form)}, {"kappa", kernel.kappa}, {"epsilon", kernel.epsilon}};
}

/// How the file says which voxels are active. A threshold without bound has no meaning.
Json topologyOf(const RunRecord& record, std::size_t g) {
  const StoredGrid& grid = record.grids[g].stored();
  const bool byThreshold = !grid.voxels && (grid.topology == TopologyKind::kThreshold ||
                                            grid.topology == TopologyKind::kBricks);
  return {{"kind", grid.voxels ? "voxels" : cli::nameOf(grid.topology)},
          {"threshold", byThreshold ? Json(grid.activeThreshold) : Json(nullptr)},
          {"bricks", grid.bricks.size()},
          {"mask_bytes", bytesOf(record.output, g, "mask")}};
}

Json fitOf(const ConvertedGrid& grid) {
  const FitResult& fit = grid.conversion.fit;
  return {{"end", nameOf(fit.end)},
          {"wanted", fit.wanted},
          {"device", grid.device},
          {"device_bytes", fit.deviceBytes},
          {"device_full", fit.deviceFull},
          {"chunks", fit.chunks},
          {"pairs", fit.pairs}};
}

Json candidateOf(const std::optional<Candidate>& candidate) {
  if (!candidate) return nullptr;
  return {{"bytes", candidate->bytes},
          {"psnr_box", orNull(candidate->psnr)},
          {"estimated", candidate->estimated}};
}

const char* representationOf(const StoredGrid& grid) {
  if (grid.voxels) return "voxels";
  return grid.residual ? "ellipsoids and residual" : "ellipsoids";
}

Json choiceOf(const ConvertedGrid& grid) {
  const ChoiceRecord choice = grid.conversion.choice.value_or(ChoiceRecord{});
  return {{"stored", representationOf(grid.stored())},
          {"voxels", candidateOf(choice.voxels)},
          {"ellipsoids", candidateOf(choice.ellipsoids)}};
}

Json compactOf(const ConvertedGrid& grid) {
  if (!grid.conversion.compact) return nullptr;
  const auto& [loss, steps] = *grid.conversion.compact;
  const StreamBytes bytes = streamBytes(grid.stored());
  return {{"loss_db", loss},
          {"steps",
           {{"positions", steps.position},
            {"scales", steps.scale},
            {"rotations", steps.rotation},
            {"intensities", steps.intensity}}},
          {"bytes",
           {{"positions", bytes.positions},
            {"scales", bytes.scales},
            {"rotations", bytes.rotations},
            {"intensities", bytes.intensities}}}};
}

/// The errors of the first importance layers.
Json layersOf(const StoredGrid& grid) {
  Json layers = Json::array();
  const auto sizes = layerSizes(grid);
  LayerSize sum;
  for (std::size_t k = 0; k < grid.layerErrors.size(); ++k) {
    sum.ellipsoids += sizes[k].ellipsoids;
    sum.bytes += sizes[k].bytes;
    layers.push_back({{"ellipsoids", sum.ellipsoids},
                      {"bytes", sum.bytes},
                      {"psnr_box", grid.layerErrors[k].psnrBox},
                      {"max_error", grid.layerErrors[k].maxError}});
  }
  return layers;
}

/// The errors of the surface of a narrow band; other grids have none.
Json surfaceOf(const std::optional<SurfaceErrors>& surface) {
  Json distance = nullptr;
  if (surface && surface->distance)
    distance = {{"voxels", surface->distance->voxels}, {"world", surface->distance->world}};
  return {{"sign_errors", surface ? Json(surface->signs.voxels) : Json(nullptr)},
          {"mesh_distance", std::move(distance)}};
}

Json sectionsOf(const EsvrSummary& file, std::size_t grid) {
  Json sections = Json::array();
  for (const auto& s : file.sections)
    if (s.grid == grid)
      sections.push_back({{"kind", s.kind},
                          {"codec", s.codec},
                          {"bytes", s.storedBytes},
                          {"raw_bytes", s.rawBytes},
                          {"shared", s.sharedWith.has_value()}});
  return sections;
}

Json curveOf(const std::vector<TimedCurvePoint>& curve) {
  Json points = Json::array();
  for (const auto& p : curve)
    points.push_back({{"seconds", p.seconds},
                      {"iteration", p.iteration},
                      {"ellipsoids", p.ellipsoids},
                      {"psnr_box", p.psnrBox},
                      {"psnr_active", p.psnrActive},
                      {"max_error", p.maxError}});
  return points;
}

/// What a grid gains by other grids of the file.
Json sharedOf(const ConvertedGrid& grid) {
  if (!grid.shared) return nullptr;
  const GridConversion::Shared& shared = *grid.shared;
  return {{"with", grid.sharesWith.empty() ? Json(nullptr) : Json(grid.sharesWith)},
          {"bytes_with", shared.bytesWith},
          {"bytes_without", shared.bytesWithout},
          {"seconds", shared.seconds}};
}

Json metricsJson(const VolumeMetrics& m) {
  return {{"peak", m.peak},
          {"box_voxels", m.boxVoxels},
          {"psnr_box", m.psnrBox},
          {"psnr_active", m.psnrActive},
          {"max_error", m.maxError},
          {"max_error_at", {m.maxErrorAt.x, m.maxErrorAt.y, m.maxErrorAt.z}},
          {"p999_error", m.p999Error},
          {"iou", m.iou},
          {"mass_reference", m.massReference},
          {"mass", m.massCandidate}};
}

/// What is seen of a grid that is looked through; other grids have none.
Json qualityOf(const VolumeMetrics& m) {
  if (!m.transmittance) return nullptr;
  return {{"median_depth", m.transmittance->medianDepth},
          {"psnr_t90", m.transmittance->psnr90},
          {"psnr_t50", m.transmittance->psnr50},
          {"psnr_t10", m.transmittance->psnr10}};
}

Json secondsJson(const PhaseSeconds& s) {
  return {{"read", s.read},
          {"seed", s.seed},
          {"optimise", s.optimise},
          {"encode", s.encode},
          {"measure", s.measure}};
}

Json gridJson(const RunRecord& record, std::size_t g) {
  const ConvertedGrid& grid = record.grids[g];
  return {{"name", grid.uniqueName},
          {"component_of", grid.id.component ? Json(grid.sourceName) : Json(nullptr)},
          {"same_as", grid.twinOf ? Json(grid.sameAs) : Json(nullptr)},
          {"as_previous_frame", grid.asBefore},
          {"shared", sharedOf(grid)},
          {"source", sourceOf(record, g)},
          {"ellipsoids", grid.stored().field.ellipsoidCount()},
          {"bytes", cli::ownBytes(record.output, g)},
          {"sections", sectionsOf(record.output, g)},
          {"measured", measureOf(grid.conversion)},
          {"surface_bound", orNull(grid.conversion.surfaceBound)},
          {"tone", grid.stored().tone.isOn() ? Json(grid.stored().tone.scale) : Json(nullptr)},
          {"kernel", kernelOf(grid.stored().field.kernel)},
          {"topology", topologyOf(record, g)},
          {"fit", fitOf(grid)},
          {"paper", grid.paper ? paperJson(*grid.paper) : Json(nullptr)},
          {"compact", compactOf(grid)},
          {"representation", choiceOf(grid)},
          {"layers", layersOf(grid.stored())},
          {"metrics", metricsJson(grid.metrics)},
          {"quality", qualityOf(grid.metrics)},
          {"surface", surfaceOf(grid.surface)},
          {"seconds", secondsJson(grid.seconds)},
          {"curve", curveOf(grid.conversion.fit.curve)}};
}

// A run.

/// The name and the version of a report's form. docs/report.md says when the version changes.
struct ReportSchema {
  const char* name;
  int version;
};
constexpr ReportSchema kSchema{"esvr-report", 1};

Json gridsOf(const RunRecord& record) {
  Json grids = Json::array();
  for (std::size_t g = 0; g < record.grids.size(); ++g) grids.push_back(gridJson(record, g));
  return grids;
}

/// The metrics of a vector that was not measured, because the run was interrupted, are missing.
Json toJson(const RunRecord& record, const ConvertedVector& vector) {
  Json components = Json::array();
  for (std::size_t c = 0; c < kComponents; ++c) {
    components.push_back({{"name", record.grids[vector.stored.first + c].uniqueName}});
    if (vector.metrics) components.back()["metrics"] = metricsJson(vector.metrics->components[c]);
  }
  Json json{{"name", vector.uniqueName},
            {"value_type", vector.valueType},
            {"bytes", ownBytes(record.output, vector)}};
  if (vector.metrics) json["metrics"] = metricsJson(vector.metrics->magnitude);
  json["components"] = std::move(components);
  return json;
}

Json vectorsOf(const RunRecord& record) {
  Json vectors = Json::array();
  for (const auto& vector : record.vectors) vectors.push_back(toJson(record, vector));
  return vectors;
}

Json toJson(const NotFitted& left) {
  return {{"name", left.grid.uniqueName}, {"value_type", left.grid.valueType}, {"why", left.why}};
}

Json carriedOf(const RunRecord& record) {
  Json carried = Json::array();
  for (std::size_t c = 0; c < record.carried.size(); ++c) {
    Json grid = toJson(record.carried[c]);
    grid["bytes"] = cli::ownBytes(record.output, numberOfCarried(record, c));
    grid["source_bytes"] =
        record.isOfSplats ? Json(nullptr) : Json(record.carried[c].grid.storedBytes);
    carried.push_back(grid);
  }
  return carried;
}

Json skippedOf(const RunRecord& record) {
  Json skipped = Json::array();
  for (const auto& left : record.skipped) skipped.push_back(toJson(left));
  for (const auto& name : record.notFitted)
    skipped.push_back({{"name", name}, {"value_type", nullptr}, {"why", "interrupted"}});
  return skipped;
}

PhaseSeconds sumOf(const std::vector<ConvertedGrid>& grids) {
  PhaseSeconds sum;
  for (const auto& grid : grids) {
    const PhaseSeconds& s = grid.seconds;
    sum.read += s.read, sum.seed += s.seed;
    sum.optimise += s.optimise, sum.encode += s.encode, sum.measure += s.measure;
  }
  return sum;
}

Json totalSeconds(const RunRecord& record) {
  Json seconds = secondsJson(sumOf(record.grids));
  seconds["write"] = record.secondsWrite;
  seconds["total"] = record.secondsTotal;
  return seconds;
}

const char* nameOf(ErrorKind kind) {
  return cli::wordOf(kind, {{"usage", ErrorKind::kUsage},
                            {"bad input", ErrorKind::kBadInput},
                            {"target missed", ErrorKind::kTargetMissed},
                            {"device", ErrorKind::kDevice},
                            {"failure", ErrorKind::kRuntime}});
}

/// The first items of every report: program, versions and options.
Json reportHead(const Options& options, const ReportSchema& schema) {
  return {{"schema", schema.name},
          {"schema_version", schema.version},
          {"program", kProgram},
          {"command_line", options.commandLine},
          {"versions", cli::versionJson()},
          {"asked", askedJson(options)}};
}

}  // namespace

bool reportIsFile(const Options& options) {
  return !options.report.empty() && options.report != cli::kStandardOutput;
}

Json makeReport(const Options& options, const RunRecord& record) {
  const Ratio ratio = ratioOf(record);
  Json report = reportHead(options, kSchema);
  report.update({{"input",
                  {{"path", options.namedInput().string()},
                   {"format", record.input.format},
                   {"bytes", record.input.fileBytes},
                   {"bytes_converted", ratio.bytesIn}}},
                 {"output",
                  {{"path", options.output.string()},
                   {"bytes", ratio.bytesOut},
                   {"bytes_separate",
                    record.bytesSeparate > 0 ? Json(record.bytesSeparate) : Json(nullptr)}}},
                 {"ratio", ratio.value()},
                 {"grids", gridsOf(record)},
                 {"vectors", vectorsOf(record)},
                 {"carried", carriedOf(record)},
                 {"skipped", skippedOf(record)},
                 {"seconds", totalSeconds(record)},
                 {"peak_memory_bytes", cli::peakMemory()},
                 {"interrupted", record.interrupted},
                 {"error", nullptr},
                 {"exit_code", exitCodeOf(record)}});
  return report;
}

Json makeFailureReport(const Options& options, const Error& error) {
  Json report = reportHead(options, kSchema);
  report.update({{"input", {{"path", options.namedInput().string()}}},
                 {"error", {{"kind", nameOf(error.kind())}, {"message", error.what()}}},
                 {"exit_code", error.exitCode()}});
  return report;
}

// A sequence.

namespace {

constexpr ReportSchema kSequenceSchema{"esvr-sequence", 1};

/// The items of a conversion's report that a sequence has once, or has for the whole run only.
constexpr const char* kOfSequence[]{"schema",           "schema_version", "program",
                                    "command_line",     "versions",       "asked",
                                    "peak_memory_bytes"};

Json outputOf(const FrameRecord& frame) {
  const bool isThere = frame.bytesOut > 0;
  return {{"path", frame.frame.output.string()},
          {"bytes", isThere ? Json(frame.bytesOut) : Json(nullptr)}};
}

Json entryOf(const SequenceRecord& record, const FrameRecord& frame) {
  Json entry{{"frame", frame.frame.number}, {"state", nameOf(frame.state)}};
  entry["held_from"] =
      frame.frame.holds ? Json(record.frames[*frame.frame.holds].frame.number) : Json(nullptr);
  entry["input"] = {{"path", frame.frame.input.string()}};
  entry["output"] = outputOf(frame);
  entry["group"] = orNull(frame.group);
  entry["error"] = nullptr;
  if (frame.report.is_object()) entry.update(frame.report);
  return entry;
}

Json framesOf(const SequenceRecord& record) {
  Json frames = Json::array();
  for (const FrameRecord& frame : record.frames) frames.push_back(entryOf(record, frame));
  return frames;
}

Json rangesOf(const SequenceRecord& record) {
  Json grids = Json::array();
  for (const GridRange& range : gridRanges(record))
    grids.push_back({{"name", range.name},
                     {"frames", range.frames},
                     {"psnr_active", {range.lowestActive, range.highestActive}},
                     {"psnr_box", {range.lowestBox, range.highestBox}},
                     {"psnr_t50", range.lowestT50 ? Json{*range.lowestT50, *range.highestT50}
                                                  : Json(nullptr)}});
  return grids;
}

/// The output of the whole run; a file of all frames has bytes and groups.
Json outputOf(const Options& options, const SequenceRecord& record) {
  Json output{{"path", options.output.string()}};
  if (!record.file) return output;
  output["bytes"] = orNull(record.file->bytes);
  output["groups"] = record.file->groups;
  return output;
}

Json countsOf(const SequenceRecord& record) {
  Json counts;
  for (const FrameState state :
       {FrameState::kConverted, FrameState::kHeld, FrameState::kKept, FrameState::kMissing,
        FrameState::kFailed, FrameState::kInterrupted, FrameState::kNotBegun})
    counts[nameOf(state)] = framesIn(state, record).size();
  return counts;
}

}  // namespace

Json frameReport(Json conversion) {
  for (const char* item : kOfSequence) conversion.erase(item);
  return conversion;
}

Json makeSequenceReport(const Options& options, const SequenceRecord& record) {
  const auto amiss = whatIsAmiss(record);
  Json report = reportHead(options, kSequenceSchema);
  report.update({{"input", {{"path", options.namedInput().string()}}},
                 {"output", outputOf(options, record)},
                 {"states", countsOf(record)},
                 {"grids", rangesOf(record)},
                 {"frames", framesOf(record)},
                 {"seconds", record.seconds},
                 {"peak_memory_bytes", cli::peakMemory()},
                 {"interrupted", record.interrupted},
                 {"exit_code", amiss ? amiss->exitCode() : 0}});
  return report;
}

}  // namespace esvr::vdb2esvr
