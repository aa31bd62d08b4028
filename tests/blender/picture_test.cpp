// Plan: Cycles renders a file and the file that came back from .esvr with the same camera, light and
// random numbers. The PSNR of the two pictures, with a peak of 1, is at least 40 dB. Each picture
// shows something: a black one is far from it.

#include <gtest/gtest.h>

#include "blender/blender.h"
#include "cli/vdb_inputs.h"

namespace esvr {
namespace {

class BlenderPicture : public test::Blender {
 protected:
  /// Converts a file there and back, and compares its picture with that of the result.
  /// \param grid  as for render_pictures.py
  void expectSamePicture(const std::string& source, const std::string& grid,
                         const std::vector<std::string>& options) {
    convertThereAndBack(source, options);
    runScript("render_pictures.py",
              {at("psnr.json"), grid, source, at("source.exr"), at("back.vdb"), at("back.exr")});
    const auto figures = nlohmann::json::parse(test::readText(at("psnr.json")));
    constexpr double kVisible = 20.0;  // dB; a tenth of the peak over the whole picture
    EXPECT_LT(figures["psnr_of_black"], kVisible);
    EXPECT_GE(figures["psnr"][0], 40.0);
    RecordProperty("psnr", figures["psnr"][0].dump());
  }
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
