#pragma once
/// Differences of two grids besides their voxels.

#include <span>
#include <string>
#include <vector>

#include "esvr/grid_descriptor.h"
#include "esvr/inactive_values.h"

namespace esvr::compare {

enum class DifferenceKind {
  kName,
  kClass,
  kValueType,
  kBackground,
  kTransform,
  kMetadata,
  kInactive  ///< values of inactive voxels and tiles
};

struct Difference {
  DifferenceKind kind = DifferenceKind::kName;
  std::string text;  ///< text with the reference first: "class: level set, fog volume"
};

/// Lists the differences of two descriptors. Transforms are equal if the bytes of their maps are,
/// or if both are affine and no entry of the matrices differs by more than 1e-12 of the largest,
/// since NanoVDB stores maps in another form with rounding. Metadata items that repeat the name,
/// the class or the value type are ignored.
[[nodiscard]] std::vector<Difference> compareDescriptors(const GridDescriptor& reference,
                                                         const GridDescriptor& candidate);

/// The difference of the values of inactive voxels; nothing if they are the same.
[[nodiscard]] std::vector<Difference> compareInactive(const InactiveValues& reference,
                                                      const InactiveValues& candidate);

/// Lists the items that only one side has or that have different values, except for `ignored`.
[[nodiscard]] std::vector<Difference> compareMetadata(std::span<const MetaItem> reference,
                                                      std::span<const MetaItem> candidate,
                                                      std::span<const std::string> ignored);

}  // namespace esvr::compare
