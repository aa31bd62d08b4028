// Plan: Cycles renders a file and the file that came back from .esvr with the same camera, light and
// random numbers. The PSNR of the two pictures, with a peak of 1, is at least 40 dB. Each picture
// shows something: a black one is far from it.

#include <gtest/gtest.h>

#include <cmath>

#include "blender/blender.h"
#include "cli/exr_channel.h"
#include "cli/vdb_inputs.h"

namespace esvr {
namespace {

using Pixels = std::vector<float>;

Pixels readPixels(const std::string& path) {
  Pixels pixels;
  for (const char* channel : {"R", "G", "B"})
    for (const float value : test::readExr(path, channel)) pixels.push_back(value);
  return pixels;
}

/// dB, with a peak of 1
double psnr(const Pixels& a, const Pixels& b) {
  double squares = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) squares += std::pow(double(a[i]) - double(b[i]), 2);
  return -10.0 * std::log10(squares / double(a.size()));
}

class BlenderPicture : public test::Blender {
 protected:
  /// Converts a file there and back, and compares its picture with that of the result.
  /// \param grid  as for render_pictures.py
  void expectSamePicture(const std::string& source, const std::string& grid,
                         const std::vector<std::string>& options) {
    convertThereAndBack(source, options);
    runScript("render_pictures.py",
              {grid, source, at("source.exr"), at("back.vdb"), at("back.exr")});
    const Pixels expected = readPixels(at("source.exr")), shown = readPixels(at("back.exr"));
    ASSERT_EQ(expected.size(), kValues);
    constexpr double kVisible = 20.0;  // dB; a tenth of the peak over the whole picture
    EXPECT_LT(psnr(expected, Pixels(kValues)), kVisible);
    EXPECT_GE(psnr(expected, shown), 40.0);
    RecordProperty("psnr", std::to_string(psnr(expected, shown)));
  }
  static constexpr std::size_t kValues = 3 * 256 * 256;
};

TEST_F(BlenderPicture, SlowOfAPlumeIsTheSame) {
  makeSample("plume", "48");
  expectSamePicture(at("in.vdb"), "density", {});
}

TEST_F(BlenderPicture, SlowOfVectorsIsTheSame) {
  auto voxels = test::cloud(12);
  for (const auto& voxel : test::softBall({30, 0, 0})) voxels.push_back(voxel);
  test::writeVectorInput(at("in.vdb"), {.voxels = voxels},
                         {{.voxels = voxels, .map = test::InputMap::kRotated}});
  expectSamePicture(at("in.vdb"), "velocity", {});
}

TEST_F(BlenderPicture, SlowOfRealFileIsTheSame) {
  if (std::string(ESVR_DATA_DIR).empty())
    GTEST_SKIP() << "needs the real volumes: configure with -DESVR_DATA_DIR=<their folder>";
  // The values reach 5.7, but smoke of a hundredth is visible. A bound keeps it.
  expectSamePicture(std::string(ESVR_DATA_DIR) + "/smoke1.vdb", "density",
                    {"--max-error", "0.01", "--representation", "voxels"});
}

}  // namespace
}  // namespace esvr
