#include "compare/measure_stability.h"

#include <algorithm>
#include <cmath>

#include "cli/grid_stability.h"
#include "esvr/device_bricks.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/grid_names.h"
#include "esvr/vector_grid.h"

namespace esvr::compare {
namespace {

/// Measures a stored grid.
class GridMeasurement {
 public:
  GridMeasurement(const StabilityRun& run, const StoredGrid& grid) : run_(run), grid_(grid) {
    requireMemory();
    options_ = cli::stabilityOptionsOf(grid, run.request.samples);
  }

  void measureOn(const Device& device, GridStability& result) {
    std::vector<float> values;
    StabilityOptions options = options_;
    options.arithmetic = arithmeticOf(device);
    options.evaluate = [&](const Field& field, std::span<const Coord> corners,
                           std::span<float> out) {
      evaluateBricksOn(device, field, corners, out);
      values.assign(out.begin(), out.end());
    };
    DeviceStability measured{deviceName(device), measureStability(grid_.field, options)};
    const double share = shareOfPeak(result, measured.stability.largest);
    measured.passes = share <= run_.request.maxDifference;
    result.devices.push_back(std::move(measured));
    compareWithFirst(values, result);
  }

 private:
  /// Checks the memory for the list of bricks and for the prepared ellipsoids.
  void requireMemory() const {
    constexpr double kBytesOfBrick = 64.0, kBytesOfEllipsoid = 512.0;
    requireWithinMemory(kBytesOfBrick * estimateDecode(grid_).bricks +
                            kBytesOfEllipsoid * double(grid_.field.ellipsoidCount()),
                        run_.request.memory.maxBytes,
                        "grid '" + shownName(grid_.descriptor.name) + "'");
  }

  /// Compares a device with the first one, on the same bricks.
  void compareWithFirst(std::vector<float>& values, GridStability& result) {
    if (result.devices.size() == 1) {
      first_ = std::move(values);
      return;
    }
    double largest = 0.0;
    for (std::size_t v = 0; v < values.size(); ++v)
      largest = std::max(largest, std::abs(clamped(values[v]) - clamped(first_[v])));
    result.betweenDevices = largest;
  }
  [[nodiscard]] double clamped(float value) const {
    return options_.range ? std::clamp(value, options_.range->min, options_.range->max) : value;
  }

  const StabilityRun& run_;
  const StoredGrid& grid_;
  StabilityOptions options_;
  std::vector<float> first_;  ///< values on the first device
};

GridStability measureGrid(const StabilityRun& run, const StoredGrid& grid,
                          const std::string& name) {
  GridStability result{.name = name,
                       .ellipsoids = grid.field.ellipsoidCount(),
                       .peak = cli::peakOfSource(grid),
                       .corrected = grid.residual.has_value()};
  if (grid.voxels) result.whyNone = "it is stored as voxels";
  if (result.ellipsoids == 0 && result.whyNone.empty()) result.whyNone = "it has no ellipsoids";
  if (!result.whyNone.empty()) return result;
  GridMeasurement measurement(run, grid);
  for (const Device& device : run.devices) {
    if (run.cancel.cancelled()) throw Cancelled();
    measurement.measureOn(device, result);
  }
  return result;
}

/// The indices of the grids in the file's list that are measured.
std::vector<std::size_t> chosenGrids(const StabilityRun& run, const GridFile& file) {
  std::vector<std::size_t> chosen;
  for (const auto& name : run.request.grids) chosen.push_back(file.find(name));
  if (chosen.empty())
    for (std::size_t g = 0; g < file.grids().size(); ++g) chosen.push_back(g);
  std::ranges::sort(chosen);
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

}  // namespace

std::vector<GridStability> measureFile(const StabilityRun& run, const GridFile& file) {
  if (file.esvr() == nullptr)
    throw BadInput(file.path().string() + ": not an .esvr file, so it has no ellipsoids");
  const EsvrFile& esvr = *file.esvr();
  std::vector<GridStability> results;
  for (const std::size_t g : chosenGrids(run, file)) {
    const auto& [isCarried, index, isVector] = file.grids()[g].ofEsvr;
    const std::string& name = file.grids()[g].uniqueName;
    if (isCarried)
      results.push_back({.name = name, .whyNone = "it is carried unchanged"});
    else if (!isVector)
      results.push_back(measureGrid(run, esvr.grids[index], name));
    else
      for (std::size_t c = 0; c < kComponents; ++c)
        results.push_back(measureGrid(run, componentsOf(esvr, esvr.vectors[index])[c],
                                      file.names().ofComponent(g, c)));
  }
  return results;
}

}  // namespace esvr::compare
