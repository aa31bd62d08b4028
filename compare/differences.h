#pragma once
/// What two grids differ in besides their voxels.

#include <span>
#include <string>
#include <vector>

#include "esvr/grid_descriptor.h"

namespace esvr::compare {

enum class DifferenceKind { kName, kClass, kValueType, kBackground, kTransform, kMetadata };

struct Difference {
  DifferenceKind kind = DifferenceKind::kName;
  std::string text;  ///< for the user, the reference first: "class: level set, fog volume"
};

/// Transforms are equal where their maps are, byte for byte, or where both are affine and no entry
/// of the matrices differs by more than 1e-12 of the largest: NanoVDB keeps a map in another form,
/// and what it rounds is no difference. Metadata that name, class and value type repeat are not
/// listed twice.
[[nodiscard]] std::vector<Difference> compareDescriptors(const GridDescriptor& reference,
                                                         const GridDescriptor& candidate);

/// Items that are on one side only or have another value, by name; `ignored` is passed over.
[[nodiscard]] std::vector<Difference> compareMetadata(std::span<const MetaItem> reference,
                                                      std::span<const MetaItem> candidate,
                                                      std::span<const std::string> ignored);

}  // namespace esvr::compare
