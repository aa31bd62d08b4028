#pragma once
/// A dense image of any type, read slab by slab.

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/coord.h"
#include "images/image_choice.h"

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
  std::string type;  ///< a name of elementType()
  bool bigEndian = false;
  std::uint64_t headerBytes = 0;  ///< bytes to skip at the beginning
  std::array<double, 3> voxelSize{1.0, 1.0, 1.0};
  bool endsWithData = true;  ///< whether no other bytes may follow the data
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

/// Opens a stack of slices: the pages of all files in their order. Reduced copies of pages are left
/// out. The text of ImageJ or OME in a file says which pages belong to which channel, and gives the
/// edges of voxels; without it, they are 1.
/// \param paths  at least one
/// \param choice  component: a color or a channel
/// \throws BadInput  a file is not readable (the text says why), or its pages do not fit together
/// \throws UsageError  the choice does not fit
/// \throws MemoryExceeded  a slice does not fit into memory
[[nodiscard]] std::unique_ptr<ImageSource> openTiff(const std::vector<std::filesystem::path>& paths,
                                                    const ImageChoice& choice);

/// Opens a NIfTI-1 or NIfTI-2 image, which may be compressed. Its values are scaled as the header
/// says. Its place in space is the sform, else the qform, else the spacings.
/// \param choice  component: the index of a volume, or of a color
/// \throws BadInput  the file is not readable, or its type is not a number
/// \throws UsageError  the choice does not fit
[[nodiscard]] std::unique_ptr<ImageSource> openNifti(const std::filesystem::path& path,
                                                     const ImageChoice& choice);

/// Opens VTK's XML image data with one piece, with data in any form that VTK writes but compressed
/// by anything else than zlib. The image of an array of cells has its voxels in the centers of the
/// cells.
/// \param choice  dataset: the name of an array, which need not be given if there is only one, or
///                if the file names an active one
/// \throws BadInput  the file is not readable (the text says why)
/// \throws UsageError  the choice does not fit; the text lists the arrays
[[nodiscard]] std::unique_ptr<ImageSource> openVti(const std::filesystem::path& path,
                                                   const ImageChoice& choice);

/// Opens a dataset of an HDF5 file. The last axis is x. Leading axes of length 1 are left out. Of four
/// remaining axes, the shorter one of the first and the last (the last if they are equal) is that
/// of the components. The attribute element_size_um of the dataset, if there is one, gives the edges
/// of voxels.
/// \param choice  dataset: its path, which need not be given if there is only one with three axes
/// \throws BadInput  the file is not readable (the text says why)
/// \throws UsageError  the choice does not fit; the text lists the datasets
/// \throws MemoryExceeded  a slice does not fit into memory
[[nodiscard]] std::unique_ptr<ImageSource> openHdf5(const std::filesystem::path& path,
                                                    const ImageChoice& choice);

}  // namespace esvr::samples
