#pragma once
/// --images: pictures of every row from the same views, against pictures of the reference.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esvr/flip.h"
#include "esvr/image.h"
#include "esvr/progress.h"
#include "esvr/render.h"
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
};

/// The function with values no further than `threshold` from the background transparent: what an
/// .esvr counts as inactive is empty space, and not a haze of the ellipsoids' ends.
[[nodiscard]] TransferFunction withEmptySpace(const TransferFunction& function, double background,
                                              double threshold);

/// Means over all pictures; the PSNR is that of the mean squared error.
struct ImageFigures {
  double psnr = 0.0, ssim = 0.0, flip = 0.0;
  double fps = 0.0;  ///< pictures in a second of drawing, by the median picture
};

/// The first picture of a row, and where it errs.
struct Shown {
  std::string picturePng, errorPng;
};

class Gallery {
 public:
  /// Draws the reference. \throws UsageError  as renderVolume; Cancelled
  Gallery(const GalleryOptions& options, const SparseVolume& reference, const CancelToken& cancel);

  using Draw = std::function<Image(const RenderOptions&)>;
  struct Compared {
    ImageFigures figures;
    Shown shown;
  };
  [[nodiscard]] Compared compare(const Draw& draw) const;
  [[nodiscard]] const std::string& referencePng() const { return referencePng_; }
  /// Pictures in a second of drawing the reference, by the median picture.
  [[nodiscard]] double referenceFps() const { return referenceFps_; }

 private:
  std::vector<RenderOptions> views_;
  std::vector<Image> references_;
  std::string referencePng_;
  double referenceFps_ = 0.0;
};

}  // namespace esvr::compare
