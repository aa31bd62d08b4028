#include "vdb2esvr/grid_report.h"

#include "cli/names.h"
#include "esvr/grid_names.h"
#include "vdb2esvr/json_values.h"
#include "vdb2esvr/paper_report.h"
#include "vdb2esvr/scene_notes.h"

namespace esvr::vdb2esvr {
namespace {

using Json = nlohmann::ordered_json;

const char* nameOf(FitEnd end) {
  switch (end) {
    case FitEnd::kScheduleDone:
      return "schedule done";
    case FitEnd::kPsnrReached:
      return "psnr reached";
    case FitEnd::kTimeUp:
      return "time up";
    case FitEnd::kCancelled:
      return "interrupted";
    case FitEnd::kPsnrMissed:
      return "psnr missed";
  }
  return "";
}

/// The inactive values that the file does not hold; null if there is none.
Json inactiveOf(const InactiveValues& values) {
  if (values.count() == 0) return nullptr;
  const bool hasRange = values.count() > values.nonFinite();
  return {{"count", values.count()},
          {"value_range", hasRange ? Json{values.min(), values.max()} : Json(nullptr)},
          {"nonfinite", values.nonFinite()}};
}

Json sourceOf(const ConvertedGrid& grid) {
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
          {"mask_bytes", bytesOf(record.output, g, "mask")},
          {"level_bytes", bytesOf(record.output, g, "levels")}};
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
  const SharedBytes& shared = *grid.shared;
  return {{"with", shared.with.empty() ? Json(nullptr) : Json(shared.with)},
          {"bytes_with", shared.bytesWith},
          {"bytes_without", shared.bytesWithout},
          {"seconds", shared.seconds}};
}

/// The parts that the file does without. A figure that is not known has no key.
Json leftOutOf(const RunRecord& record, std::size_t g) {
  Json list = Json::array();
  for (const LeftOut& note : leftOut(record, g)) {
    Json entry{{"part", note.part}, {"why", note.why}, {"used", note.used}};
    if (note.bytesWith) entry["bytes_with"] = *note.bytesWith;
    if (note.bytesWithout) entry["bytes_without"] = *note.bytesWithout;
    if (note.seconds) entry["seconds"] = *note.seconds;
    list.push_back(entry);
  }
  return list;
}

}  // namespace

Json gridJson(const RunRecord& record, std::size_t g) {
  const ConvertedGrid& grid = record.grids[g];
  return {{"name", grid.uniqueName},
          {"component_of", grid.id.component ? Json(grid.sourceName) : Json(nullptr)},
          {"same_as", grid.twinOf ? Json(grid.sameAs) : Json(nullptr)},
          {"shared", sharedOf(grid)},
          {"source", sourceOf(grid)},
          {"ellipsoids", grid.stored().field.ellipsoidCount()},
          {"bytes", cli::ownBytes(record.output, g)},
          {"sections", sectionsOf(record.output, g)},
          {"kernel", kernelOf(grid.stored().field.kernel)},
          {"topology", topologyOf(record, g)},
          {"fit", fitOf(grid)},
          {"paper", grid.paper ? paperJson(*grid.paper) : Json(nullptr)},
          {"compact", compactOf(grid)},
          {"representation", choiceOf(grid)},
          {"layers", layersOf(grid.stored())},
          {"metrics", metricsJson(grid.metrics)},
          {"surface", surfaceOf(grid.surface)},
          {"seconds", secondsJson(grid.seconds)},
          {"left_out", leftOutOf(record, g)},
          {"curve", curveOf(grid.conversion.fit.curve)}};
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

Json secondsJson(const PhaseSeconds& s) {
  return {{"read", s.read},
          {"seed", s.seed},
          {"optimise", s.optimise},
          {"encode", s.encode},
          {"measure", s.measure}};
}

}  // namespace esvr::vdb2esvr
