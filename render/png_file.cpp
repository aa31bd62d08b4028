#include "render/png_file.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>

#include "esvr/error.h"

namespace esvr::render {
namespace {

constexpr int kChannels = 4;
using Bytes = std::vector<std::byte>;

png_byte byteOf(double v) { return png_byte(std::lround(std::clamp(v, 0.0, 1.0) * 255.0)); }

void fillPixel(const float* from, const std::optional<Rgb>& background, png_byte* to) {
  const double alpha = from[3], behind = 1.0 - alpha;
  const Rgb ground = background.value_or(Rgb{});
  const double grounds[] = {ground.r, ground.g, ground.b};
  for (int c = 0; c < 3; ++c) {
    const double color = from[c];
    to[c] = background ? byteOf(color + behind * grounds[c])
                       : byteOf(alpha > 0.0 ? color / alpha : 0.0);
  }
  to[3] = background ? byteOf(1.0) : byteOf(alpha);
}

std::vector<png_byte> pixelsOf(const Image& image, const std::optional<Rgb>& background) {
  std::vector<png_byte> pixels(image.rgba.size());
  for (std::size_t i = 0; i < pixels.size(); i += kChannels)
    fillPixel(&image.rgba[i], background, &pixels[i]);
  return pixels;
}

/// What libpng is given and gives back. It is C and leaves by longjmp: nothing on its way may need
/// a destructor, so everything that does lives here.
struct Writing {
  std::vector<png_byte> pixels;
  std::vector<png_bytep> rows;
  Bytes bytes;
  std::string error;
};

Writing& writingOf(png_voidp pointer) { return *static_cast<Writing*>(pointer); }

void append(png_structp png, png_bytep data, png_size_t size) {
  Bytes& bytes = writingOf(png_get_io_ptr(png)).bytes;
  const auto* from = reinterpret_cast<const std::byte*>(data);
  bytes.insert(bytes.end(), from, from + size);
}
void noFlush(png_structp) {}

void onError(png_structp png, png_const_charp message) {
  writingOf(png_get_error_ptr(png)).error = message;
  png_longjmp(png, 1);
}
void onWarning(png_structp, png_const_charp) {}

struct PngStructs {
  explicit PngStructs(Writing& writing)
      : png(png_create_write_struct(PNG_LIBPNG_VER_STRING, &writing, onError, onWarning)),
        info(png == nullptr ? nullptr : png_create_info_struct(png)) {}
  ~PngStructs() { png_destroy_write_struct(&png, &info); }
  PngStructs(const PngStructs&) = delete;
  PngStructs& operator=(const PngStructs&) = delete;

  png_structp png;
  png_infop info;
};

png_text textChunk(const char* key, const std::string& text) {
  png_text chunk{};
  chunk.compression = PNG_ITXT_COMPRESSION_NONE;
  chunk.key = const_cast<char*>(key);  // libpng copies it
  chunk.text = const_cast<char*>(text.c_str());
  return chunk;
}

bool write(const PngStructs& s, Writing& writing, Resolution size, const PngText& text) {
  png_text chunks[] = {textChunk("Software", text.software), textChunk("Comment", text.comment)};
  if (setjmp(png_jmpbuf(s.png)) != 0) return false;
  png_set_write_fn(s.png, &writing, append, noFlush);
  png_set_IHDR(s.png, s.info, png_uint_32(size.width), png_uint_32(size.height), 8,
               PNG_COLOR_TYPE_RGB_ALPHA, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(s.png, s.info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_text(s.png, s.info, chunks, 2);
  png_set_rows(s.png, s.info, writing.rows.data());
  png_write_png(s.png, s.info, PNG_TRANSFORM_IDENTITY, nullptr);
  return true;
}

}  // namespace

Bytes encodePng(const Image& image, const std::optional<Rgb>& background, const PngText& text) {
  Writing writing{pixelsOf(image, background), {}, {}, {}};
  for (int row = 0; row < image.height; ++row)
    writing.rows.push_back(&writing.pixels[std::size_t(row) * image.width * kChannels]);
  const PngStructs structs(writing);
  if (structs.info == nullptr) throw std::bad_alloc();
  if (!write(structs, writing, {image.width, image.height}, text))
    throw RuntimeFailure("libpng: " + writing.error);
  return std::move(writing.bytes);
}

}  // namespace esvr::render
