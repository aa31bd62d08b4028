#pragma once
/// The option --images: compares pictures of every row with pictures of the reference from the same
/// views.

#include <optional>
#include <string>
#include <vector>

#include "compare/picture_metric.h"
#include "esvr/flip.h"
#include "esvr/image.h"
#include "esvr/progress.h"
#include "esvr/renderer.h"
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
  std::string lpips;  ///< command for PictureMetric; empty: none
};

/// Mean figures over all pictures; the PSNR is that of the mean squared error.
struct ImageFigures {
  double psnr = 0.0, ssim = 0.0, flip = 0.0;
  double fps = 0.0;                            ///< pictures per second by the median drawing time
  std::optional<std::uint64_t> deviceBytes{};  ///< CUDA memory of the renderer
  std::optional<double> lpips{};               ///< LPIPS if a command was given
};

/// The first picture of a row and its map of errors in the colors of report::errorScale().
struct Shown {
  std::string picturePng, errorPng;
};

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
  /// The exceptions are those of Renderer::draw and PictureMetric.
  [[nodiscard]] Compared compare(Renderer& renderer) const;
  [[nodiscard]] const std::string& referencePng() const { return referencePng_; }
  /// The cost of drawing the reference; only fps and deviceBytes are set.
  [[nodiscard]] const ImageFigures& referenceCost() const { return referenceCost_; }
  [[nodiscard]] const Device& device() const { return device_; }

 private:
  std::vector<RenderOptions> views_;
  Device device_;
  std::optional<PictureMetric> lpips_;
  std::vector<Image> references_;
  std::string referencePng_;
  ImageFigures referenceCost_;
};

}  // namespace esvr::compare
