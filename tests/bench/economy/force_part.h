#pragma once
/// Adds a part to a stored grid that it does not need, without changing its voxels. Only tests and
/// measurements do this; vdb2esvr leaves such parts out.

#include <optional>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr::economy {

enum class Part { kRotations, kSigns, kKappas, kResidual, kMask, kLevels, kLayers, kChunks };

struct NamedPart {
  Part part;
  const char* name;
};
[[nodiscard]] const std::vector<NamedPart>& allParts();

/// What a grid has of a part, or what keeps it from having it.
struct PartState {
  bool stored = false;
  /// Why forcing the part in makes no sense; empty if forcedPart() can do it, or if it is stored.
  std::string why{};
};
[[nodiscard]] PartState stateOf(const StoredGrid& grid, Part part);

/// The grid with a part that stateOf() says it lacks and can have.
/// \param decoded  decodeGrid(grid)
[[nodiscard]] StoredGrid forcedPart(const StoredGrid& grid, Part part, const SparseVolume& decoded);

}  // namespace esvr::economy
