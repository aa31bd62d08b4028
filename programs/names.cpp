// Names of the enumerations that files hold, what tells grids of one name apart, and bytes of grids.
#include "programs/names.h"

#include <map>

#include "programs/messages.h"
#include "programs/option_values.h"

namespace esvr::cli {

std::string nameOf(ValueType type) {
  return wordOf(
      type,
      {{"half", ValueType::kHalf}, {"double", ValueType::kDouble}, {"float", ValueType::kFloat}});
}

std::string nameOf(KernelForm form) { return form == KernelForm::kPaper ? "paper" : "continuous"; }

std::string nameOf(TopologyKind kind) {
  return wordOf(kind, {{"bricks", TopologyKind::kBricks},
                       {"mask", TopologyKind::kMask},
                       {"threshold", TopologyKind::kThreshold}});
}

std::string activityOf(const StoredGrid& grid) {
  if (grid.topology == TopologyKind::kMask) return "a mask";
  return "threshold " + shortNumber(grid.activeThreshold);
}

std::string textOf(const NonFiniteCounts& counts) {
  std::string text;
  const auto add = [&](std::uint64_t count, const char* kind) {
    if (count > 0) text += (text.empty() ? "" : " and ") + std::to_string(count) + " " + kind;
  };
  add(counts.nan, "NaN");
  add(counts.plusInfinity, "+infinity");
  add(counts.minusInfinity, "-infinity");
  return text + (counts.total() == 1 ? " voxel" : " voxels");
}

std::string valuesOf(const GridSummary& grid) {
  return grid.savedAsHalf ? grid.valueType + " as half" : grid.valueType;
}

std::string activeVoxelsOf(const GridSummary& grid) {
  return grid.isScalar || grid.activeVoxels > 0 ? std::to_string(grid.activeVoxels) : "-";
}

namespace {

GridTraits traitsOf(const GridSummary& grid) {
  return {grid.name, grid.valueType, grid.gridClass, grid.activeVoxels, grid.activeBox};
}

/// The traits of the grid of a .vdb file that is stored so.
GridTraits traitsOf(const EsvrFile& file, const GridOfFile& grid) {
  if (grid.isCarried) {
    const CarriedGrid& carried = file.carried[grid.index];
    if (carried.bytes.empty()) return {.name = carried.name};  // they were not read
    return traitsOf(inspectCarried(carried));
  }
  const StoredGrid& first = file.grids[grid.isVector ? file.vectors[grid.index].first : grid.index];
  const bool isDouble = first.descriptor.valueType == ValueType::kDouble;
  GridTraits traits{nameOf(file, grid), isDouble ? "double" : "float", first.descriptor.gridClass,
                    first.activeVoxels, first.activeBox};
  if (grid.isVector) traits.valueType = isDouble ? "vec3d" : "vec3s";
  traits.values = {first.valueMin, first.valueMax};
  return traits;
}

}  // namespace

std::vector<GridTraits> traitsOf(const VdbSummary& file) {
  std::vector<GridTraits> traits;
  for (const GridSummary& grid : file.grids) traits.push_back(traitsOf(grid));
  return traits;
}

std::vector<GridTraits> traitsOf(const EsvrFile& file) {
  std::vector<GridTraits> traits;
  for (const GridOfFile& grid : gridsInOrder(file)) traits.push_back(traitsOf(file, grid));
  return traits;
}

void addRanges(std::span<const GridTraits> other,
               const std::function<std::optional<std::array<float, 2>>(std::size_t)>& rangeOf,
               std::vector<GridTraits>& traits) {
  std::map<std::string, std::size_t> counts, others;
  for (const GridTraits& grid : traits) ++counts[grid.name];
  for (const GridTraits& grid : other) ++others[grid.name];
  for (std::size_t g = 0; g < traits.size(); ++g) {
    const auto there = others.find(traits[g].name);
    const bool isNeeded = there != others.end() && there->second != counts[traits[g].name];
    if (isNeeded && !traits[g].values) traits[g].values = rangeOf(g);
  }
}

std::uint64_t bytesIf(const EsvrSummary& file,
                      const std::function<bool(const SectionSummary&)>& counts) {
  std::uint64_t bytes = 0;
  for (const SectionSummary& section : file.sections)
    if (counts(section)) bytes += section.storedBytes;
  return bytes;
}

std::uint64_t storedBytes(const EsvrSummary& file, std::size_t grid) {
  return bytesIf(file, [&](const auto& section) { return section.grid == grid; });
}

std::uint64_t ownBytes(const EsvrSummary& file, std::size_t grid) {
  return bytesIf(file,
                 [&](const auto& section) { return section.grid == grid && !section.sharedWith; });
}

}  // namespace esvr::cli
