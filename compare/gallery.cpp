// The option --images: compares pictures of every row with pictures of the reference from the same views.
#include "compare/table.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <sstream>
#include <utility>

#include "esvr/error.h"
#include "esvr/image_metrics.h"
#include "esvr/metrics.h"
#include "programs/files.h"
#include "programs/option_values.h"
#include "programs/page_figures.h"
#include "programs/pictures.h"
#include "programs/run_main.h"

namespace esvr::compare {

// Metrics of the user.

namespace {

std::filesystem::path written(const Image& image, const std::filesystem::path& path) {
  constexpr bool kOverwrite = true;
  const std::string png = report::toPng(image);
  cli::writeBytes(path, std::as_bytes(std::span(png)), kOverwrite);
  return path;
}

double lastNumber(const std::string& command, const std::string& text) {
  std::istringstream words(text);
  std::string word, last;
  while (words >> word) last = word;
  const auto value = cli::parseNumber(last);
  if (!value)
    throw RuntimeFailure("--lpips: " + command + " printed '" + last + "', which is not a number");
  return *value;
}

/// The figure that a command of the user computes for a picture.
double figureOf(const std::string& command, const std::filesystem::path& folder,
                const Image& reference, const Image& picture) {
  const std::string line = command + " " +
                           cli::shellWord(written(reference, folder / "reference.png").string()) +
                           " " + cli::shellWord(written(picture, folder / "picture.png").string());
  return lastNumber(command, outputOf(line, "--lpips"));
}

}  // namespace

// Pictures of voxels.

std::unique_ptr<Renderer> makeVoxelRenderer(const SparseVolume& volume, NanoValues values,
                                            const Device& device) {
  if (device.kind == DeviceKind::kCpu) return makeVolumeRenderer(volume, device);
  VolumeGrid grid;
  grid.descriptor.background = volume.background;
  grid.descriptor.transform = uniformTransform(1.0);  // pictures are drawn in index space
  grid.volume = volume;
  return makeNanoRenderer(makeNanoVolume(grid, values), device);
}

// All pictures of a table.

namespace {

ValueRange rangeOf(const SparseVolume& volume) {
  const ValueRange range = activeRange(volume);
  return {std::min(range.min, volume.background), std::max(range.max, volume.background)};
}

std::vector<RenderOptions> viewsOf(const GalleryOptions& options, const SparseVolume& reference,
                                   const CancelToken& cancel) {
  const Camera first =
      fitCamera(activeBox(reference), {.framing = Framing::kSphere}, options.resolution);
  std::vector<RenderOptions> views;
  for (const auto& transfer : options.transfers)
    for (int view = 0; view < options.views; ++view) {
      RenderOptions r;
      r.camera = turned(first, 360.0 * view / options.views);
      r.resolution = options.resolution;
      r.transfer = rescaled(transfer.function, rangeOf(reference));
      r.step = options.step;
      r.cancel = &cancel;
      views.push_back(std::move(r));
    }
  return views;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

/// Draws pictures and measures the time. On a CUDA device the copy of the picture to the host does
/// not count.
class Clock {
 public:
  Clock(Renderer& renderer, const Device& device)
      : renderer_(renderer), onDevice_(device.kind == DeviceKind::kCuda) {}

  Image draw(const RenderOptions& view) {
    cli::Stopwatch watch;
    if (!onDevice_) {
      Image image = renderer_.draw(view);
      seconds_.push_back(watch.lap());
      return image;
    }
    renderer_.drawOnDevice(view);
    seconds_.push_back(watch.lap());
    return renderer_.draw(view);
  }
  [[nodiscard]] ImageFigures cost() const {
    ImageFigures figures;
    figures.fps = 1.0 / median(seconds_);
    if (onDevice_) figures.deviceBytes = renderer_.stats().deviceBytes;
    return figures;
  }

 private:
  Renderer& renderer_;
  bool onDevice_;
  std::vector<double> seconds_;
};

/// Sums over pictures.
struct Sums {
  double squares = 0.0, ssim = 0.0, flip = 0.0;

  void add(const Image& reference, const Image& candidate) {
    const ImageMetrics metrics = compareImages(reference, candidate);
    squares += std::pow(10.0, -metrics.psnr / 10.0);
    ssim += metrics.ssim;
    flip += esvr::flip(reference, candidate).mean;
  }
  /// \param cost  figures whose fps and deviceBytes are used
  [[nodiscard]] ImageFigures over(double pictures, ImageFigures cost) const {
    constexpr double kPeak = 1.0;
    cost.psnr = psnr(squares / pictures, kPeak);
    cost.ssim = ssim / pictures;
    cost.flip = flip / pictures;
    return cost;
  }
};

std::string errorPng(const Image& reference, const Image& image) {
  Image map = errorMap(reference, image, 1.0 / report::kMostError);
  report::colorErrors(map);
  return report::toPng(map);
}

}  // namespace

Gallery::Gallery(const GalleryOptions& options, const SparseVolume& reference, const Device& device,
                 const std::filesystem::path& folder, const CancelToken& cancel)
    : views_(viewsOf(options, reference, cancel)),
      device_(device),
      lpips_(options.lpips),
      folder_(folder) {
  const auto renderer = makeVoxelRenderer(reference, NanoValues::kFloat, device);
  Clock clock(*renderer, device);
  for (const auto& view : views_) references_.push_back(clock.draw(view));
  referencePng_ = report::toPng(references_.front());
  referenceCost_ = clock.cost();
}

Gallery::Compared Gallery::compare(Renderer& renderer) const {
  Clock clock(renderer, device_);
  Sums sums;
  double lpips = 0.0;
  Compared result;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const Image image = clock.draw(views_[i]);
    sums.add(references_[i], image);
    if (!lpips_.empty()) lpips += figureOf(lpips_, folder_, references_[i], image);
    if (i == 0) result.shown = {report::toPng(image), errorPng(references_[i], image)};
  }
  result.figures = sums.over(double(views_.size()), clock.cost());
  if (!lpips_.empty()) result.figures.lpips = lpips / double(views_.size());
  return result;
}

}  // namespace esvr::compare
