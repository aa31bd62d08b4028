#include "cli/stability_json.h"

#include <cmath>

namespace esvr::cli {
namespace {

using Json = nlohmann::ordered_json;

Json toJson(Coord c) { return {c.x, c.y, c.z}; }

Json toJson(const BrickDifference& brick) {
  return {{"brick", toJson(brick.corner)},
          {"voxel", toJson(brick.at)},
          {"max_difference", finiteOrNull(brick.largest)},
          {"bound", finiteOrNull(brick.bound)}};
}

}  // namespace

Json finiteOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json differencesJson(const Stability& s) {
  Json worst = Json::array();
  for (const BrickDifference& brick : s.worst) worst.push_back(toJson(brick));
  return {{"max_difference", finiteOrNull(s.largest)},
          {"rms_difference", finiteOrNull(s.rms)},
          {"bound", finiteOrNull(s.bound)},
          {"share_of_bound", finiteOrNull(s.shareOfBound)},
          {"worst", std::move(worst)}};
}

Json difficultiesJson(const Stability& s) {
  const FieldExtremes& e = s.extremes;
  return {{"scale", {e.smallestScale, e.largestScale}},
          {"aspect", e.largestAspect},
          {"condition", e.largestCondition},
          {"kappa", {e.lowestKappa, e.highestKappa}},
          {"intensity", {e.smallestIntensity, e.largestIntensity}},
          {"overlap", {{"mean", s.meanOverlap}, {"max", s.largestOverlap}}},
          {"cancellation", {{"mean", s.meanCancellation}, {"max", s.largestCancellation}}},
          {"bricks", s.bricks},
          {"bricks_sampled", s.sampled}};
}

}  // namespace esvr::cli
