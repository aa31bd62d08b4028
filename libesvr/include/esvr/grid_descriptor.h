#pragma once
/// A grid without its voxels: all that a VDB must get back to be the grid it was.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace esvr {

/// A VDB metadata item, kept as the bytes OpenVDB writes for its value, so that any type travels.
struct MetaItem {
  std::string name;
  std::string type;              ///< OpenVDB's type name: "string", "float", "vec3s", ...
  std::vector<std::byte> value;  ///< Metadata::write's bytes, without the leading size
  friend bool operator==(const MetaItem&, const MetaItem&) = default;
};

enum class GridClass { kUnknown = 0, kLevelSet = 1, kFogVolume = 2, kStaggered = 3 };

/// The type of the source's voxels; the fit works in float.
enum class ValueType {
  kFloat = 0,
  kHalf = 1,    ///< FloatGrid saved as half
  kDouble = 2,  ///< narrowed to float: at most 6e-8 of the value is lost
};

/// The index-to-world map of a grid.
struct Transform {
  std::string
      mapType;  ///< OpenVDB's map name: "UniformScaleMap", "AffineMap", "NonlinearFrustumMap"...
  std::vector<std::byte>
      map;  ///< the map as OpenVDB serialises it (math::MapBase::write), verbatim
  /// Row-vector affine 4x4 (world = [i j k 1] * M, row major) where the map is linear: for readers
  /// without OpenVDB. Nothing for a frustum.
  std::optional<std::array<double, 16>> affine;
  friend bool operator==(const Transform&, const Transform&) = default;
};

struct GridDescriptor {
  std::string name;  ///< as in the grid's own metadata: not unique
  GridClass gridClass = GridClass::kUnknown;
  ValueType valueType = ValueType::kFloat;
  double background = 0.0;
  Transform transform;
  std::vector<MetaItem> metadata;  ///< all but what a writer regenerates (file_*)
  friend bool operator==(const GridDescriptor&, const GridDescriptor&) = default;
};

}  // namespace esvr
