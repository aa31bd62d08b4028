#include "compare/stability_report.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "cli/printable.h"
#include "cli/stability_json.h"
#include "cli/table.h"

namespace esvr::compare {
namespace {

using Json = nlohmann::ordered_json;
using cli::shortNumber;

constexpr const char* kStabilitySchema = "esvr-stability";
constexpr int kStabilityVersion = 1;
constexpr std::size_t kWorstShown = 3;  ///< bricks of each grid that are printed

void printDifferences(const StabilityRecord& record, std::ostream& out) {
  cli::Table table(
      {"grid", "device", "max difference", "rms", "bound", "share of peak", "verdict"});
  for (const GridStability& grid : record.grids)
    for (const DeviceStability& device : grid.devices) {
      const Stability& s = device.stability;
      table.add({grid.name, device.device, shortNumber(s.largest), shortNumber(s.rms),
                 shortNumber(s.bound), shortNumber(shareOfPeak(grid, s.largest)),
                 verdictOf(grid, device)});
    }
  table.print(out);
}

std::string rangeText(double low, double high) {
  return low == high ? shortNumber(low) : shortNumber(low) + " to " + shortNumber(high);
}

/// What does not depend on the device.
void printDifficulties(const StabilityRecord& record, std::ostream& out) {
  cli::Table table({"grid", "ellipsoids", "scales", "aspect", "condition", "kappa", "overlap",
                    "max overlap", "cancellation", "max cancellation", "bricks"});
  for (const GridStability& grid : record.grids) {
    if (grid.devices.empty()) continue;
    const Stability& s = grid.devices.front().stability;
    const FieldExtremes& e = s.extremes;
    table.add({grid.name, std::to_string(grid.ellipsoids),
               rangeText(e.smallestScale, e.largestScale), shortNumber(e.largestAspect),
               shortNumber(e.largestCondition), rangeText(e.lowestKappa, e.highestKappa),
               shortNumber(s.meanOverlap), std::to_string(s.largestOverlap),
               shortNumber(s.meanCancellation), shortNumber(s.largestCancellation),
               std::to_string(s.sampled) + " of " + std::to_string(s.bricks)});
  }
  table.print(out);
}

void printNotes(const GridStability& grid, std::ostream& out) {
  const std::string name = "grid \"" + grid.name + "\"";
  if (!grid.whyNone.empty())
    out << cli::printable(name + ": nothing to measure, " + grid.whyNone) << '\n';
  if (grid.corrected)
    out << cli::printable(name + ": the sum of its ellipsoids was measured, without its residual")
        << '\n';
  if (grid.betweenDevices)
    out << cli::printable(name + ": CPU and GPU differ by at most ")
        << shortNumber(*grid.betweenDevices) << '\n';
  for (const DeviceStability& device : grid.devices)
    for (std::size_t n = 0; n < std::min(kWorstShown, device.stability.worst.size()); ++n) {
      const BrickDifference& brick = device.stability.worst[n];
      out << cli::printable(name + ", " + device.device + ": ") << shortNumber(brick.largest)
          << " at voxel " << toString(brick.at) << " of brick " << toString(brick.corner) << '\n';
    }
}

Json toJson(const GridStability& grid, const DeviceStability& device) {
  Json json{{"device", device.device},
            {"verdict", device.passes ? "pass" : "fail"},
            {"correct_digits", correctDigits(device.stability.largest, grid.peak)},
            {"share_of_peak", cli::finiteOrNull(shareOfPeak(grid, device.stability.largest))}};
  json.update(cli::differencesJson(device.stability));
  return json;
}

Json toJson(const GridStability& grid) {
  Json devices = Json::array();
  for (const auto& device : grid.devices) devices.push_back(toJson(grid, device));
  return {{"name", grid.name},
          {"frame", grid.frame ? Json(*grid.frame) : Json(nullptr)},
          {"why_none", grid.whyNone.empty() ? Json(nullptr) : Json(grid.whyNone)},
          {"ellipsoids", grid.ellipsoids},
          {"peak", grid.peak},
          {"residual", grid.corrected},
          {"difficulties", grid.devices.empty()
                               ? Json(nullptr)
                               : cli::difficultiesJson(grid.devices.front().stability)},
          {"devices", std::move(devices)},
          {"between_devices", grid.betweenDevices ? Json(*grid.betweenDevices) : Json(nullptr)}};
}

}  // namespace

std::string verdictOf(const GridStability& grid, const DeviceStability& device) {
  const int digits = correctDigits(device.stability.largest, grid.peak);
  if (device.passes)
    return device.stability.largest == 0.0 ? "PASS, no difference"
                                           : "PASS, " + std::to_string(digits) + " digits";
  return "FAIL, digit " + std::to_string(digits + 1) + " is lost";
}

void printStability(const StabilityRecord& record, std::ostream& out) {
  const bool any = std::ranges::any_of(
      record.grids, [](const GridStability& grid) { return !grid.devices.empty(); });
  if (any) {
    printDifferences(record, out);
    printDifficulties(record, out);
  }
  for (const GridStability& grid : record.grids) printNotes(grid, out);
}

Json stabilityReport(const StabilityRequest& request, const StabilityRecord& record) {
  Json grids = Json::array();
  for (const auto& grid : record.grids) grids.push_back(toJson(grid));
  return {{"schema", kStabilitySchema},
          {"schema_version", kStabilityVersion},
          {"command_line", request.commandLine},
          {"file", request.file.string()},
          {"max_difference", request.maxDifference},
          {"grids", std::move(grids)},
          {"failures", record.failures}};
}

}  // namespace esvr::compare
