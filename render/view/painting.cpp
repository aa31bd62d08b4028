#include "render/view/painting.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include "esvr/error.h"
#include "render/look.h"

#include <jpeglib.h>  // uses FILE and std::size_t without including their headers

namespace esvr::view {

RenderOptions renderOptionsOf(const Collection& collection, const SceneWish& scene,
                              Resolution size) {
  render::Options options = scene.options;
  options.resolution = size;
  return render::renderOptions(options, collection.gridAt(scene.place).outline);
}

namespace {

constexpr std::size_t kChannels = 4;

Image splitPicture(const Image& image, Image picture, double split) {
  const std::size_t row = kChannels * std::size_t(image.width);
  const std::size_t left = kChannels * std::size_t(std::lround(split * image.width));
  for (std::size_t i = 0; i < image.rgba.size(); i += row)
    std::copy_n(&image.rgba[i], left, &picture.rgba[i]);
  return picture;
}

Image differencePicture(const Image& image, Image picture, double gain) {
  for (std::size_t i = 0; i < picture.rgba.size(); ++i)
    picture.rgba[i] = i % kChannels == kChannels - 1
                          ? 1.0f
                          : float(gain) * std::abs(picture.rgba[i] - image.rgba[i]);
  return picture;
}

}  // namespace

Image comparisonPicture(const Image& image, const Image& reference, const Comparison& comparison) {
  switch (comparison.show) {
    case CompareShow::kSplit:
      return splitPicture(image, reference, comparison.split);
    case CompareShow::kDifference:
      return differencePicture(image, reference, comparison.gain);
    case CompareShow::kReference:
      break;
  }
  return reference;
}

Painting::Part::Part(const Input& input, const GridPlace& place, RenderOptions of)
    : drawable(input.drawables.get(place)), options(std::move(of)) {
  options.cancel = input.cancel;
  if (drawable) {
    renderer = &drawable->renderer(options.shading.has_value());
    passes.emplace(*renderer, options);
  } else {
    whole = Image{input.size.width, input.size.height, {}};
    whole->rgba.resize(kChannels * std::size_t(whole->width) * std::size_t(whole->height));
  }
}

void Painting::Part::refine(double seconds) {
  if (passes) passes->refine(seconds);
}

void Painting::Part::complete() {
  if (!isComplete()) whole = renderer->draw(options);
}

Painting::Painting(const Input& input)
    : comparison_(input.scene.compare),
      own_(input, input.scene.place, renderOptionsOf(input.collection, input.scene, input.size)) {
  // The reference is drawn like the grid.
  if (comparison_) reference_.emplace(input, comparison_->with, own_.options);
}

void Painting::refine(double seconds) {
  const double share = reference_ ? seconds / 2.0 : seconds;
  own_.refine(share);
  if (reference_) reference_->refine(share);
}

void Painting::complete() {
  own_.complete();
  if (reference_) reference_->complete();
}

bool Painting::isComplete() const {
  return own_.isComplete() && (!reference_ || reference_->isComplete());
}

Image Painting::picture() const {
  return reference_ ? comparisonPicture(own_.image(), reference_->image(), *comparison_)
                    : own_.image();
}

std::optional<ImageMetrics> Painting::errors() const {
  if (!reference_) return std::nullopt;
  return compareImages(reference_->image(), own_.image());
}

std::uint64_t Painting::deviceBytes() const {
  std::uint64_t bytes = 0;
  if (own_.renderer) bytes += own_.renderer->stats().deviceBytes;
  if (reference_ && reference_->renderer) bytes += reference_->renderer->stats().deviceBytes;
  return bytes;
}

// ---- JPEG files

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
