#pragma once
/// A dense image of any type, read slab by slab.

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "esvr/coord.h"

namespace esvr::samples {

/// Some slices of an image.
struct Slab {
  std::int32_t firstZ = 0, slices = 0;
};

class ImageSource {
 public:
  virtual ~ImageSource() = default;

  /// Voxels along x, y and z.
  [[nodiscard]] virtual Coord size() const = 0;
  /// Largest value of an integer type; nothing for the others.
  [[nodiscard]] virtual std::optional<double> typeMaximum() const = 0;
  /// Row-vector affine 4x4, row major.
  [[nodiscard]] virtual std::array<double, 16> indexToWorld() const = 0;
  /// x fastest, then y, z. Integers beyond 2^24 and doubles are rounded to float.
  /// \throws BadInput  the file ends before
  virtual void read(const Slab& slab, std::span<float> out) = 0;
};

/// What a file without a header cannot say of itself.
struct RawLayout {
  Coord size;
  std::string
      type;  ///< "uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"
  bool bigEndian = false;
  std::uint64_t headerBytes = 0;  ///< to skip
  double voxelSize = 1.0;
};

/// \throws BadInput  missing, or not exactly as long as the layout says; UsageError: no such type
[[nodiscard]] std::unique_ptr<ImageSource> openRaw(const std::filesystem::path& path,
                                                   const RawLayout& layout);

/// NRRD with the data in the same file or beside it (.nhdr), any encoding that teem knows.
/// \throws BadInput  not readable (says why), not three axes of scalars, larger than memory
[[nodiscard]] std::unique_ptr<ImageSource> openNrrd(const std::filesystem::path& path);

}  // namespace esvr::samples
