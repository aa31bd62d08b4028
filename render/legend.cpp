#include "render/legend.h"

#include <algorithm>

#include "report/video_file.h"

namespace esvr::render {
namespace {

constexpr int kShades = 1024;  // more than the rows of usual bars

struct Ends {
  double low, high;
};

/// The values from the first to the last point of a transfer function.
Ends endsOf(const TransferFunction& f) {
  return {std::min(f.colors.points.front().x, f.opacity.front().x),
          std::max(f.colors.points.back().x, f.opacity.back().x)};
}

report::Shade shadeOf(const TransferFunction& f, double value) {
  const Rgb color = colorAt(f.colors, value);
  return {{color.r, color.g, color.b}, opacityAt(f.opacity, value)};
}

}  // namespace

report::ColorBar legendOf(const Options& options, const Scene& scene,
                          const TransferFunction& transfer) {
  const auto [low, high] = endsOf(transfer);
  report::ColorBar bar{.name = scene.grid, .unit = scene.unit, .low = low, .high = high};
  for (int i = 0; i < kShades; ++i)
    bar.shades.push_back(shadeOf(transfer, low + (i + 0.5) / kShades * (high - low)));
  // A picture without a background is transparent, and a video is black.
  const bool video = report::isVideo(options.output);
  const Rgb behind = options.background.value_or(video ? Rgb{} : Rgb{1.0, 1.0, 1.0});
  bar.background = {behind.r, behind.g, behind.b};
  return bar;
}

}  // namespace esvr::render
