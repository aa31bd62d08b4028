#pragma once
/// The option --images: compares pictures of every row with pictures of the reference from the same
/// views.

#include <filesystem>
#include <string>
#include <vector>

#include "compare/table_record.h"
#include "esvr/device.h"
#include "esvr/image.h"
#include "esvr/render.h"
#include "esvr/vdb_io.h"

namespace esvr::compare {

struct NamedTransfer {
  std::string name;
  TransferFunction function;  ///< function that is rescaled to the range of the reference's values
};

struct GalleryOptions {
  int views = 0;  ///< number of views of a full turn; 0: no pictures
  Resolution resolution{400, 400};
  double step = 1.0;
  std::vector<NamedTransfer> transfers;
  /// Shell command that gets the files of the reference and a picture as arguments (8-bit PNG in front
  /// of black), and whose last word is a figure of both, for example LPIPS; empty: none
  std::string lpips;
};

/// The views of a table: draws the reference once, and compares the pictures of each row with it.
class Gallery {
 public:
  /// Draws the reference on a device.
  /// \param folder  folder for temporary files
  /// \throws UsageError, Cancelled, DeviceError  as for renderVolume and makeVolumeRenderer
  Gallery(const GalleryOptions& options, const SparseVolume& reference, const Device& device,
          const std::filesystem::path& folder, const CancelToken& cancel);

  struct Compared {
    ImageFigures figures;
    Shown shown;
  };
  /// \throws RuntimeFailure  the command of GalleryOptions fails, or its last word is not a number; else
  ///                         as for Renderer::draw
  [[nodiscard]] Compared compare(Renderer& renderer) const;
  [[nodiscard]] const std::string& referencePng() const { return referencePng_; }
  /// The cost of drawing the reference; only fps and deviceBytes are set.
  [[nodiscard]] const ImageFigures& referenceCost() const { return referenceCost_; }
  [[nodiscard]] const Device& device() const { return device_; }

 private:
  std::vector<RenderOptions> views_;
  Device device_;
  std::string lpips_;
  std::filesystem::path folder_;
  std::vector<Image> references_;
  std::string referencePng_;
  ImageFigures referenceCost_;
};

/// Makes the renderer of a row's pictures. On a CUDA device it draws a NanoVDB grid of this value type,
/// and on the CPU the volume itself.
/// \throws DeviceError  as for makeNanoRenderer
[[nodiscard]] std::unique_ptr<Renderer> makeVoxelRenderer(const SparseVolume& volume,
                                                          NanoValues values, const Device& device);

}  // namespace esvr::compare
