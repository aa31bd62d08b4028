#include "cli/names.h"

#include "cli/table.h"

namespace esvr::cli {

std::string nameOf(ValueType type) {
  switch (type) {
    case ValueType::kHalf:
      return "half";
    case ValueType::kDouble:
      return "double";
    case ValueType::kFloat:
      break;
  }
  return "float";
}

std::string nameOf(KernelForm form) { return form == KernelForm::kPaper ? "paper" : "continuous"; }

std::string nameOf(TopologyKind kind) {
  switch (kind) {
    case TopologyKind::kBricks:
      return "bricks";
    case TopologyKind::kMask:
      return "mask";
    case TopologyKind::kBlocks:
      return "blocks";
    case TopologyKind::kThreshold:
      break;
  }
  return "threshold";
}

std::string activityOf(const StoredGrid& grid) {
  if (grid.topology == TopologyKind::kMask) return "a mask";
  if (grid.topology != TopologyKind::kBlocks)
    return "threshold " + shortNumber(grid.activeThreshold);
  return "thresholds of blocks around " +
         shortNumber(thresholdAt(grid.activeThreshold, kMiddleLevel));
}

std::string valuesOf(const GridSummary& grid) {
  return grid.savedAsHalf ? grid.valueType + " as half" : grid.valueType;
}

std::string activeVoxelsOf(const GridSummary& grid) {
  return grid.isScalar || grid.activeVoxels > 0 ? std::to_string(grid.activeVoxels) : "-";
}

std::uint64_t storedBytes(const EsvrSummary& file, std::size_t grid) {
  std::uint64_t bytes = 0;
  for (const auto& section : file.sections)
    if (section.grid == grid) bytes += section.storedBytes;
  return bytes;
}

std::uint64_t ownBytes(const EsvrSummary& file, std::size_t grid) {
  std::uint64_t bytes = 0;
  for (const auto& section : file.sections)
    if (section.grid == grid && !section.sharedWith) bytes += section.storedBytes;
  return bytes;
}

}  // namespace esvr::cli
