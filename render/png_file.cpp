#include "render/image_files.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>

#include "esvr/error.h"

namespace esvr::render {
namespace {

constexpr int kPngChannels = 4;
using Bytes = std::vector<std::byte>;

/// Appends a channel with the most significant byte first, as PNG requires.
void append(double v, int bits, std::vector<png_byte>& to) {
  const double maxLevel = double((1 << bits) - 1);
  const auto level = unsigned(std::lround(std::clamp(v, 0.0, 1.0) * maxLevel));
  if (bits > 8) to.push_back(png_byte(level >> 8));
  to.push_back(png_byte(level & 0xffu));
}

/// The alpha of a transparent pixel. Light of a grid that emits but does not absorb can exceed the
/// alpha of the picture, and a PNG could not hold it.
double alphaFor(const float* pixel) {
  constexpr float kRounding = 1e-6f;  // of an alpha that is 1 less a transmittance
  const float alpha = pixel[3], most = *std::max_element(pixel, pixel + 3);
  return most > alpha + kRounding ? most : alpha;
}

void appendPixel(const float* from, const PngForm& form, std::vector<png_byte>& to) {
  const double alpha = form.background ? from[3] : alphaFor(from), behind = 1.0 - alpha;
  const Rgb ground = form.background.value_or(Rgb{});
  const double grounds[] = {ground.r, ground.g, ground.b};
  for (int c = 0; c < 3; ++c) {
    const double color = from[c];
    append(form.background ? color + behind * grounds[c] : (alpha > 0.0 ? color / alpha : 0.0),
           form.bits, to);
  }
  append(form.background ? 1.0 : alpha, form.bits, to);
}

std::vector<png_byte> pixelsOf(const Image& image, const PngForm& form) {
  std::vector<png_byte> pixels;
  pixels.reserve(image.rgba.size() * std::size_t(form.bits / 8));
  for (std::size_t i = 0; i < image.rgba.size(); i += kPngChannels)
    appendPixel(&image.rgba[i], form, pixels);
  return pixels;
}

/// The data that libpng reads and writes. libpng leaves by longjmp on errors, which skips
/// destructors; all objects that need one therefore live here, outside the jump.
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

/// The header of a PNG file.
struct PngHeader {
  int width, height, bits;
};

bool write(const PngStructs& s, Writing& writing, const PngHeader& header,
           const PictureText& text) {
  png_text chunks[] = {textChunk("Software", text.software), textChunk("Comment", text.comment)};
  if (setjmp(png_jmpbuf(s.png)) != 0) return false;
  png_set_write_fn(s.png, &writing, append, noFlush);
  png_set_IHDR(s.png, s.info, png_uint_32(header.width), png_uint_32(header.height), header.bits,
               PNG_COLOR_TYPE_RGB_ALPHA, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(s.png, s.info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_text(s.png, s.info, chunks, 2);
  png_set_rows(s.png, s.info, writing.rows.data());
  png_write_png(s.png, s.info, PNG_TRANSFORM_IDENTITY, nullptr);
  return true;
}

}  // namespace

Bytes encodePng(const Image& image, const PngForm& form, const PictureText& text) {
  Writing writing{pixelsOf(image, form), {}, {}, {}};
  const std::size_t ofRow =
      std::size_t(image.width) * std::size_t(kPngChannels) * std::size_t(form.bits / 8);
  for (int row = 0; row < image.height; ++row)
    writing.rows.push_back(&writing.pixels[std::size_t(row) * ofRow]);
  const PngStructs structs(writing);
  if (structs.info == nullptr) throw std::bad_alloc();
  if (!write(structs, writing, {image.width, image.height, form.bits}, text))
    throw RuntimeFailure("libpng: " + writing.error);
  return std::move(writing.bytes);
}

}  // namespace esvr::render
