#include "vdb2esvr/paper_report.h"

#include <nlohmann/json.hpp>

namespace esvr::vdb2esvr {
namespace {

using Json = nlohmann::ordered_json;

const char* nameOf(PruneScore score) {
  switch (score) {
    case PruneScore::kWithoutFa:
      return "no-fa";
    case PruneScore::kOnlyFa:
      return "only-fa";
    case PruneScore::kContribution:
      return "contribution";
    case PruneScore::kRays:
      return "rays";
    case PruneScore::kFull:
      break;
  }
  return "full";
}

Json ratesOf(const PaperRates& rates) {
  return {{"position", rates.position},
          {"scale", rates.scale},
          {"rotation", rates.rotation},
          {"intensity", rates.intensity},
          {"k", rates.k}};
}

Json densifyOf(const PaperRecord& record) {
  const PaperMethod& m = record.method;
  if (!m.densify) return nullptr;
  return {{"from", m.densifyFrom},
          {"until", m.densifyUntil},
          {"every", m.densifyEvery},
          {"threshold", m.gradientThreshold},
          {"first_median_gradient", record.firstGradient},
          {"percent_dense", m.percentDense},
          {"max", m.maxEllipsoids},
          {"cloned", record.cloned},
          {"split", record.split}};
}

Json prunesOf(const PaperRecord& record) {
  Json passes = Json::array();
  for (const PruneRecord& pass : record.prunes)
    passes.push_back({{"epoch", pass.epoch},
                      {"before", pass.before},
                      {"after", pass.after},
                      {"psnr_box_before", pass.psnrBoxBefore},
                      {"psnr_box_after", pass.psnrBoxAfter},
                      {"hits_before", pass.hitsBefore}});
  return passes;
}

}  // namespace

Json paperJson(const PaperRecord& record) {
  const PaperMethod& m = record.method;
  return {{"kernel", m.gaussian ? "gaussian" : "ellipsoid"},
          {"k", m.gaussian ? Json(nullptr) : (m.learnK ? Json("learned") : Json(m.k))},
          {"beta", m.beta},
          {"points", record.points},
          {"epochs", m.epochs},
          {"iterations", record.iterations},
          {"subvolume_side", record.subvolumeSide},
          {"subvolumes", record.subvolumes},
          {"rates", ratesOf(m.rates)},
          {"densify", densifyOf(record)},
          {"prune_score", nameOf(m.score)},
          {"prunes", prunesOf(record)},
          {"hits", record.hits}};
}

}  // namespace esvr::vdb2esvr
