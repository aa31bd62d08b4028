#include "report/png_image.h"

#include <cstdint>
#include <cstring>

#include "report/cairo_surface.h"
#include "report/pixel_level.h"

namespace esvr::report {
namespace {

/// A color in cairo's RGB24, with blue in the lowest byte of a word.
std::uint32_t pixelOf(const float* rgba) {
  std::uint32_t pixel = 0;
  for (int c = 0; c < 3; ++c) pixel = pixel << 8 | levelOf(rgba[c]);
  return pixel;
}

}  // namespace

std::string toPng(const Image& image) {
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, image.width, image.height));
  check(cairo_surface_status(surface.get()));
  unsigned char* data = cairo_image_surface_get_data(surface.get());
  const auto stride = std::size_t(cairo_image_surface_get_stride(surface.get()));
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const std::uint32_t pixel = pixelOf(&image.rgba[(std::size_t(y) * image.width + x) * 4]);
      std::memcpy(data + std::size_t(y) * stride + std::size_t(x) * sizeof pixel, &pixel,
                  sizeof pixel);
    }
  cairo_surface_mark_dirty(surface.get());
  return pngBytes(surface);
}

}  // namespace esvr::report
