#pragma once
/// Reads the pictures of a program with libpng.
/// The folder of a test of esvr-render.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "cli/run_program.h"
#include "esvr/container.h"
#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"
#include "field/random_field.h"

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

// ---- The folder of a test

/// A folder with a blob of ellipsoids, `in.esvr`, and with its voxels, `in.vdb`.
class EsvrRender : public testing::Test {
 protected:
  EsvrRender() {
    Field field = randomField({.count = 12, .extent = 30.0, .smallest = 4.0, .aspect = 2.0});
    for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
    const SparseVolume volume = revoxelise(field, {});
    writeEsvr(folder_ / "in.esvr", {{}, {makeStoredGrid(density(), volume, field)}});
    const VolumeGrid grid{density(), volume, 0};
    writeGrids(folder_ / "in.vdb", {}, std::span(&grid, 1));
  }

  static GridDescriptor density() {
    GridDescriptor d;
    d.name = "density";
    d.gridClass = GridClass::kFogVolume;
    d.transform = uniformTransform(0.5);
    return d;
  }
  /// Draws a small picture unless `more` has a resolution.
  ProgramRun draw(const std::string& input, const std::string& output, Words more = {}) {
    more.insert(more.begin(), {folder_ / input, folder_ / output});
    if (std::find(more.begin(), more.end(), "--resolution") == more.end())
      more.insert(more.end(), {"--resolution", "64x48"});
    return runProgram(ESVR_RENDER, more);
  }
  Pixels picture(const std::string& input, const Words& more = {}) {
    auto arguments = more;
    arguments.emplace_back("-f");
    const auto run = draw(input, "out.png", arguments);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return readPng(folder_ / "out.png");
  }
  void expectRefused(const Words& more, int exitCode, const std::string& why) {
    const auto run = draw("in.esvr", "refused.png", more);
    EXPECT_EQ(run.exitCode, exitCode) << run.err;
    EXPECT_THAT(run.err, testing::HasSubstr(why));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "refused.png"));
  }

  TemporaryFolder folder_;
};

}  // namespace esvr::test
