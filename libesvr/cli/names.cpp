#include "cli/names.h"

namespace esvr::cli {

std::string nameOf(GridClass gridClass) {
  switch (gridClass) {
    case GridClass::kLevelSet:
      return "level set";
    case GridClass::kFogVolume:
      return "fog volume";
    case GridClass::kStaggered:
      return "staggered";
    case GridClass::kUnknown:
      break;
  }
  return "unknown";
}

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
  if (kind == TopologyKind::kMask) return "mask";
  return kind == TopologyKind::kBricks ? "bricks" : "threshold";
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
