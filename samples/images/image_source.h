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

/// Consecutive slices of an image.
struct Slab {
  std::int32_t firstZ = 0, slices = 0;
};

class ImageSource {
 public:
  virtual ~ImageSource() = default;

  /// Numbers of voxels along x, y and z.
  [[nodiscard]] virtual Coord size() const = 0;
  /// Largest value of an integer type; nothing for other types.
  [[nodiscard]] virtual std::optional<double> typeMaximum() const = 0;
  /// Affine 4x4 matrix for row vectors, in row-major order.
  [[nodiscard]] virtual std::array<double, 16> indexToWorld() const = 0;
  /// Reads a slab with x fastest, then y and z. Integers above 2^24 and doubles are rounded.
  /// \throws BadInput  the file is too short
  virtual void read(const Slab& slab, std::span<float> out) = 0;
};

/// The layout of a file without a header.
struct RawLayout {
  Coord size;
  std::string
      type;  ///< "uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"
  bool bigEndian = false;
  std::uint64_t headerBytes = 0;  ///< bytes to skip at the beginning
  double voxelSize = 1.0;
};

/// Opens a RAW image.
/// \throws BadInput  the file is missing, or its length does not match the layout
/// \throws UsageError  the type is unknown
[[nodiscard]] std::unique_ptr<ImageSource> openRaw(const std::filesystem::path& path,
                                                   const RawLayout& layout);

/// Opens an NRRD image with data in the same file or in another one (.nhdr), in any encoding that
/// teem supports.
/// \throws BadInput  the file is not readable (the text says why), has not three axes of scalars,
///                   or does not fit into memory
[[nodiscard]] std::unique_ptr<ImageSource> openNrrd(const std::filesystem::path& path);

}  // namespace esvr::samples
