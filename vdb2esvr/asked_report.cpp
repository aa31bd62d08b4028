#include "vdb2esvr/asked_report.h"

#include "vdb2esvr/json_values.h"

namespace esvr::vdb2esvr {
namespace {

using Json = nlohmann::ordered_json;

const char* nameOf(Preset preset) {
  switch (preset) {
    case Preset::kDraft:
      return "draft";
    case Preset::kHigh:
      return "high";
    case Preset::kStandard:
      break;
  }
  return "standard";
}

const char* nameOf(Activity activity) {
  switch (activity) {
    case Activity::kExact:
      return "exact";
    case Activity::kByValue:
      return "threshold";
    case Activity::kAuto:
    case Activity::kNoMask:
      break;
  }
  return "auto";
}

const char* nameOf(Representation representation) {
  switch (representation) {
    case Representation::kEllipsoids:
      return "ellipsoids";
    case Representation::kVoxels:
      return "voxels";
    case Representation::kAuto:
      break;
  }
  return "auto";
}

/// The wanted bound on the error.
Json maxErrorOf(const Goal& goal) {
  const auto* within = std::get_if<BoundGoal>(&goal);
  return within ? Json(within->bound) : Json(nullptr);
}

bool isShare(const Goal& goal) {
  const auto* within = std::get_if<BoundGoal>(&goal);
  return within && within->relative;
}

/// The goals of single grids.
Json goalsOf(const std::vector<GridGoal>& goals) {
  Json list = Json::array();
  for (const GridGoal& own : goals) {
    const auto* psnr = std::get_if<PsnrGoal>(&own.goal);
    list.push_back({{"grid", own.grid},
                    {"psnr", psnr ? Json(psnr->psnr) : Json(nullptr)},
                    {"max_error", maxErrorOf(own.goal)},
                    {"max_error_is_share", isShare(own.goal)}});
  }
  return list;
}

}  // namespace

Json askedJson(const Options& options) {
  const FitOptions& fit = options.convert.fit;
  const StorageOptions& storage = options.convert.storage;
  return {{"count", orNull(fit.count)},
          {"psnr", orNull(options.psnr)},
          {"size", orNull(options.size)},
          {"ratio", orNull(options.ratio)},
          {"lossless", std::holds_alternative<LosslessGoal>(options.convert.goal)},
          {"max_error", maxErrorOf(options.convert.goal)},
          {"max_error_is_share", isShare(options.convert.goal)},
          {"representation", nameOf(options.convert.representation)},
          {"goals", goalsOf(options.gridGoals)},
          {"share", options.shares ? "auto" : "off"},
          {"seconds", orNull(fit.seconds)},
          {"iterations", orNull(fit.iterations)},
          {"method", options.paper ? "paper" : "default"},
          {"preset", nameOf(fit.preset)},
          {"box", fit.box ? toJson(*fit.box) : Json(nullptr)},
          {"storage", storage.form == Storage::kCompact ? "compact" : "float32"},
          {"topology", nameOf(storage.activity)},
          {"keep", options.grids.keep},
          {"skip", options.grids.skip},
          {"seed", fit.seed},
          {"threads", options.threads > 0 ? Json(options.threads) : Json(nullptr)},
          {"device", options.device},
          {"max_vram", orNull(fit.maxDeviceBytes)},
          {"chunk_voxels", orNull(fit.chunkVoxels)}};
}

}  // namespace esvr::vdb2esvr
