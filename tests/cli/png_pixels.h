#pragma once
/// Reads the pictures of a program with libpng.

#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <filesystem>
#include <vector>

namespace esvr::test {

struct Pixels {
  png_image header{};
  std::vector<png_byte> rgba;

  [[nodiscard]] const png_byte* at(int column, int row) const {
    return &rgba[4 * (std::size_t(row) * header.width + column)];
  }
  [[nodiscard]] std::vector<png_byte> corner() const { return {at(0, 0), at(0, 0) + 4}; }
};

inline Pixels readPng(const std::filesystem::path& path) {
  Pixels p;
  p.header.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_file(&p.header, path.c_str()), 0) << p.header.message;
  EXPECT_EQ(p.header.format, png_uint_32(PNG_FORMAT_RGBA)) << "8 bits, with alpha";
  p.header.format = PNG_FORMAT_RGBA;
  p.rgba.resize(PNG_IMAGE_SIZE(p.header));
  EXPECT_NE(png_image_finish_read(&p.header, nullptr, p.rgba.data(), 0, nullptr), 0);
  return p;
}

inline double psnrOf(const Pixels& a, const Pixels& b) {
  double squares = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    squares += std::pow((a.rgba[i] - b.rgba.at(i)) / 255.0, 2);
  return -10.0 * std::log10(squares / double(a.rgba.size()));
}

}  // namespace esvr::test
