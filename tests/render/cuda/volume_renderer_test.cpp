// Plan: the picture of a CUDA device that marches through bricks agrees with renderVolume on the
// CPU to within 1/255 of a channel, for every kind of camera, step sizes, a clip box and bands.
// Tiles that no brick covers stay empty.
#include <gtest/gtest.h>

#include <cmath>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/renderer.h"
#include "field/random_field.h"
#include "support/on_device.h"

namespace esvr::test {
namespace {

SparseVolume blobs() {
  return revoxelise(randomField({.count = 60, .extent = 90.0, .origin = {-16, 8, 0}}),
                    {.threshold = 0.05f});
}

RenderOptions options(const CameraWish& wish = {}) {
  RenderOptions o;
  o.resolution = {131, 78};
  o.camera = fitCamera({{-16, 8, 0}, {73, 97, 89}}, wish, o.resolution);
  o.transfer = rescaled({builtInColorMap("viridis"), builtInOpacity("linear")}, {-1.0f, 1.0f});
  o.opacityLength = 8.0;
  return o;
}

class BricksOnGpu : public OnGpu {
 protected:
  void expectTheCpusPicture(const RenderOptions& o, const RendererLimits& limits = {}) const {
    const SparseVolume volume = blobs();
    const Image expected = renderVolume(volume, o);
    const Image image = makeVolumeRenderer(volume, device_, limits)->draw(o);
    ASSERT_EQ(image.rgba.size(), expected.rgba.size());
    for (std::size_t i = 0; i < image.rgba.size(); ++i)
      ASSERT_NEAR(image.rgba[i], expected.rgba[i], 1.0 / 255.0);
  }
};

TEST_F(BricksOnGpu, AgreeFromEveryKindOfCamera) {
  expectTheCpusPicture(options());
  expectTheCpusPicture(options({.projection = Projection::kOrthographic}));
  expectTheCpusPicture(
      options({.eye = Vec3{19.3, 51.7, 48.1}, .center = Vec3{0, 80, 3}, .fov = 80.0}));
  CameraWish far{.eye = Vec3{1e6, 2e6, 3.3e6}, .center = Vec3{29, 53, 45}};
  far.fov = 2.0 * std::atan(60.0 / 4e6) * 180.0 / 3.14159265358979;
  expectTheCpusPicture(options(far));
}

TEST_F(BricksOnGpu, AgreeForOtherStepsAndClipped) {
  for (const double step : {0.3, 4.0}) {
    RenderOptions o = options();
    o.step = step;
    expectTheCpusPicture(o);
  }
  RenderOptions o = options();
  o.classification = Classification::kPost;
  expectTheCpusPicture(o);
  o.classification = Classification::kPreIntegrated;
  o.clip = PlaceBox{{-5, 20, 10.5}, {40, 70, 60.5}};
  expectTheCpusPicture(o);
}

TEST_F(BricksOnGpu, DrawInBandsWhereMemoryIsShort) {
  const SparseVolume volume = blobs();
  const auto whole = makeVolumeRenderer(volume, device_);
  (void)whole->draw(options());
  expectTheCpusPicture(options(), {.maxBytes = whole->stats().deviceBytes - 100'000});
  EXPECT_THROW((void)makeVolumeRenderer(volume, device_, {.maxBytes = 1000})->draw(options()),
               DeviceError);
}

}  // namespace
}  // namespace esvr::test
