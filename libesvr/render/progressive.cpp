#include "esvr/render.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "render/picture.h"

namespace esvr {
namespace {

Resolution coarser(Resolution r, int side) {
  return {(r.width + side - 1) / side, (r.height + side - 1) / side};
}

/// Two neighbouring pixels along an axis and the share of the second one.
struct PixelPair {
  int first, second;
  float share;
};
/// \param place  in pixels; beyond the middles of the outer pixels, these are taken
PixelPair pixelsAt(double place, int count) {
  const double inside = std::clamp(place, 0.0, double(count - 1));
  const int first = int(inside);
  return {first, std::min(first + 1, count - 1), float(inside - first)};
}

/// Enlarges a picture of the same camera to a resolution.
class Enlarged {
 public:
  Enlarged(const Image& from, const Camera& camera, Resolution r)
      : from_(from), fine_(camera, r), coarse_(camera, {from.width, from.height}) {
    for (int column = 0; column < r.width; ++column)
      columns_.push_back(pixelsAt(coarse_.columnAt(fine_.planeX(column)), from.width));
    image_ = {r.width, r.height, {}};
    image_.rgba.reserve(std::size_t(4) * std::size_t(r.width) * std::size_t(r.height));
    for (int row = 0; row < r.height; ++row)
      addRow(pixelsAt(coarse_.rowAt(fine_.planeY(row)), from.height));
  }
  [[nodiscard]] Image take() { return std::move(image_); }

 private:
  void addRow(const PixelPair& rows) {
    for (const PixelPair& columns : columns_)
      for (int channel = 0; channel < 4; ++channel)
        image_.rgba.push_back(mix(along(rows.first, columns, channel),
                                  along(rows.second, columns, channel), rows.share));
  }
  [[nodiscard]] float along(int row, const PixelPair& columns, int channel) const {
    return mix(at(row, columns.first, channel), at(row, columns.second, channel), columns.share);
  }
  [[nodiscard]] float at(int row, int column, int channel) const {
    const std::size_t pixel = std::size_t(row) * std::size_t(from_.width) + std::size_t(column);
    return from_.rgba[4 * pixel + std::size_t(channel)];
  }
  static float mix(float a, float b, float share) { return a + share * (b - a); }

  const Image& from_;
  const View fine_, coarse_;
  std::vector<PixelPair> columns_;
  Image image_;
};

}  // namespace

ProgressivePicture::ProgressivePicture(Renderer& renderer, RenderOptions options)
    : renderer_(renderer), options_(std::move(options)) {
  checkRenderOptions(options_, options_.further.size() + 1);  // the renderer checks their number
}

bool ProgressivePicture::refine(double seconds) try {
  const auto begin = std::chrono::steady_clock::now();
  for (double last = 0.0; !complete();) {
    drawPass();
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
    constexpr double kMorePixels = 4.0;  // than in the pass before
    const double next = kMorePixels * (passed.count() - last);
    last = passed.count();
    if (last + next > seconds) break;
  }
  show();
  return complete();
} catch (...) {
  show();
  throw;
}

void ProgressivePicture::drawPass() {
  RenderOptions pass = options_;
  pass.resolution = coarser(options_.resolution, side_);
  drawn_ = renderer_.draw(pass);
  side_ /= 2;
}

/// Enlarges the last pass. It is done once for all passes of a call, because it takes longer than
/// drawing where a GPU draws.
void ProgressivePicture::show() {
  if (!drawn_) return;
  image_ = complete() ? std::move(*drawn_)
                      : Enlarged(*drawn_, options_.camera, options_.resolution).take();
  drawn_.reset();
}

}  // namespace esvr
