#pragma once
/// The properties of a grid besides its voxels: all that is needed to restore the grid in a VDB
/// file.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace esvr {

/// A VDB metadata item. Its value is kept as the bytes that OpenVDB writes, so that every type is
/// preserved.
struct MetaItem {
  std::string name;
  std::string type;              ///< OpenVDB's type name: "string", "float", "vec3s", ...
  std::vector<std::byte> value;  ///< bytes of Metadata::write without the leading size
  friend bool operator==(const MetaItem&, const MetaItem&) = default;
};

enum class GridClass { kUnknown = 0, kLevelSet = 1, kFogVolume = 2, kStaggered = 3 };

/// The value type of the source; a fit works in float32.
enum class ValueType {
  kFloat = 0,
  kHalf = 1,    ///< a FloatGrid that was saved as half
  kDouble = 2,  ///< rounded to float32, with a relative error of at most 6e-8
};

/// The index-to-world map of a grid.
struct Transform {
  std::string mapType;  ///< OpenVDB's name: "UniformScaleMap", "AffineMap", "NonlinearFrustumMap"
  std::vector<std::byte> map;  ///< the map as OpenVDB serialises it (math::MapBase::write)
  /// Affine 4x4 matrix for row vectors (world = [i j k 1] * M, row major), for readers without
  /// OpenVDB. It is missing if the map is not linear (a frustum).
  std::optional<std::array<double, 16>> affine;
  friend bool operator==(const Transform&, const Transform&) = default;
};

struct GridDescriptor {
  std::string name;  ///< name in the grid's own metadata; not necessarily unique
  GridClass gridClass = GridClass::kUnknown;
  ValueType valueType = ValueType::kFloat;
  double background = 0.0;
  Transform transform;
  std::vector<MetaItem> metadata;  ///< all items except those that a writer regenerates (file_*)
  friend bool operator==(const GridDescriptor&, const GridDescriptor&) = default;
};

}  // namespace esvr
