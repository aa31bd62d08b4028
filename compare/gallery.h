#pragma once
/// --images: pictures of every row from the same views, against pictures of the reference.

#include <functional>
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
  TransferFunction function;  ///< to be laid over the reference's values
};

struct GalleryOptions {
  int views = 0;  ///< of a full turn; 0: no pictures
  Resolution resolution{400, 400};
  double step = 1.0;
  std::vector<NamedTransfer> transfers;
  std::string lpips;  ///< a command, as PictureMetric takes it; empty: none
};

/// The function with values no further than `threshold` from the background transparent: what an
/// .esvr counts as inactive is empty space, and not a haze of the ellipsoids' ends.
[[nodiscard]] TransferFunction withEmptySpace(const TransferFunction& function, double background,
                                              double threshold);

/// Means over all pictures; the PSNR is that of the mean squared error.
struct ImageFigures {
  double psnr = 0.0, ssim = 0.0, flip = 0.0;
  double fps = 0.0;  ///< pictures in a second of drawing, by the median picture
  std::optional<std::uint64_t> deviceBytes{};  ///< that the renderer held; of a CUDA device
  std::optional<double> lpips{};               ///< where a command was given
};

/// The first picture of a row, and where it errs.
struct Shown {
  std::string picturePng, errorPng;
};

/// What of a view is a row's own; nothing: the view as it is.
using OwnView = std::function<RenderOptions(const RenderOptions&)>;

class Gallery {
 public:
  /// Draws the reference on a device. \throws UsageError  as renderVolume; Cancelled; DeviceError
  /// \param folder  for files that come and go
  Gallery(const GalleryOptions& options, const SparseVolume& reference, const Device& device,
          const std::filesystem::path& folder, const CancelToken& cancel);

  struct Compared {
    ImageFigures figures;
    Shown shown;
  };
  /// \throws  as Renderer::draw, PictureMetric
  [[nodiscard]] Compared compare(Renderer& renderer, const OwnView& own = {}) const;
  [[nodiscard]] const std::string& referencePng() const { return referencePng_; }
  /// Of drawing the reference: fps and deviceBytes only.
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
