#include "render/view/jpeg_file.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <vector>

// It uses FILE and std::size_t without including their headers.
#include <jpeglib.h>

#include "esvr/error.h"

namespace esvr::view {
namespace {

constexpr std::size_t kImageChannels = 4, kJpegChannels = 3;

JSAMPLE levelOf(float v) { return JSAMPLE(std::clamp(v, 0.0f, 1.0f) * 255.0f + 0.5f); }

/// The opaque pixels of a picture in front of a background.
std::vector<JSAMPLE> opaquePixels(const Image& image, const Rgb& background) {
  const std::size_t width = std::size_t(image.width);
  const std::array<float, kJpegChannels> behind{float(background.r), float(background.g),
                                                float(background.b)};
  std::vector<JSAMPLE> pixels(width * std::size_t(image.height) * kJpegChannels);
  tbb::parallel_for(0, image.height, [&](int row) {
    for (std::size_t i = std::size_t(row) * width, end = i + width; i < end; ++i) {
      const float* const from = &image.rgba[i * kImageChannels];
      for (std::size_t c = 0; c < kJpegChannels; ++c)
        pixels[i * kJpegChannels + c] = levelOf(from[c] + (1.0f - from[3]) * behind[c]);
    }
  });
  return pixels;
}

/// What libjpeg works with. It leaves by longjmp on errors, which skips destructors; objects that
/// need one therefore live outside the jump.
struct JpegWriting {
  JpegWriting() {
    compress.err = jpeg_std_error(&errors);
    errors.error_exit = [](j_common_ptr info) {
      auto& writing = *static_cast<JpegWriting*>(info->client_data);
      info->err->format_message(info, writing.message.data());
      std::longjmp(writing.jump, 1);
    };
    errors.output_message = [](j_common_ptr) {};
    compress.client_data = this;
  }
  ~JpegWriting() {
    jpeg_destroy_compress(&compress);
    std::free(bytes);
  }
  JpegWriting(const JpegWriting&) = delete;
  JpegWriting& operator=(const JpegWriting&) = delete;

  jpeg_compress_struct compress{};
  jpeg_error_mgr errors{};
  std::jmp_buf jump{};
  std::array<char, JMSG_LENGTH_MAX> message{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
};

/// Chroma at full resolution, because thin colored lines on black are common.
void setForm(jpeg_compress_struct& to, const Image& image, int quality) {
  to.image_width = JDIMENSION(image.width);
  to.image_height = JDIMENSION(image.height);
  to.input_components = int(kJpegChannels);
  to.in_color_space = JCS_RGB;
  jpeg_set_defaults(&to);
  jpeg_set_quality(&to, quality, boolean(1));
  to.comp_info[0].h_samp_factor = to.comp_info[0].v_samp_factor = 1;
}

bool write(JpegWriting& writing, const Image& image, std::vector<JSAMPLE>& pixels, int quality) {
  if (setjmp(writing.jump) != 0) return false;
  jpeg_create_compress(&writing.compress);
  writing.compress.client_data = &writing;
  jpeg_mem_dest(&writing.compress, &writing.bytes, &writing.size);
  setForm(writing.compress, image, quality);
  jpeg_start_compress(&writing.compress, boolean(1));
  while (writing.compress.next_scanline < writing.compress.image_height) {
    JSAMPROW row = &pixels[std::size_t(writing.compress.next_scanline) * std::size_t(image.width) *
                           kJpegChannels];
    jpeg_write_scanlines(&writing.compress, &row, 1);
  }
  jpeg_finish_compress(&writing.compress);
  return true;
}

}  // namespace

std::string encodeJpeg(const Image& image, const JpegForm& form) {
  auto pixels = opaquePixels(image, form.background);
  JpegWriting writing;
  const int quality = int(std::lround(100.0 * std::clamp(form.quality, 0.01, 1.0)));
  if (!write(writing, image, pixels, quality))
    throw RuntimeFailure("libjpeg: " + std::string(writing.message.data()));
  return {reinterpret_cast<const char*>(writing.bytes), writing.size};
}

}  // namespace esvr::view
