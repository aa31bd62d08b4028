// Plan: the picture of a CUDA device that marches through a NanoVDB grid agrees with the CPU's to
// within 1/255 of a channel, for each value type, and in bands if memory is short.
#include <gtest/gtest.h>

#include <cmath>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/render.h"
#include "field/random_field.h"
#include "render/reference_picture.h"
#include "render/scenes.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

VolumeGrid nanoBlobs() {
  VolumeGrid grid;
  grid.descriptor.transform = uniformTransform(1.0);
  grid.volume = revoxelise(randomField({.count = 60, .extent = 40.0}), {.threshold = 0.05f});
  for (float& v : grid.volume.values) v = std::abs(v);
  return grid;
}

RenderOptions nanoOptions(double step = 1.0) {
  RenderOptions o = pictureOf(kFieldBox, {131, 78}, 8.0);
  // The opacity begins at the background. Quantised values reach it only approximately, and
  // differently on both devices.
  o.transfer = viridis({0.0f, 1.0f});
  o.step = step;
  return o;
}

void expectNanoClose(const Image& a, const Image& b) {
  EXPECT_LE(largestDifference(a, b), 1.0 / 255.0);
}

class NanoOnGpu : public OnGpu, public testing::WithParamInterface<NanoValues> {};

TEST_P(NanoOnGpu, DrawsTheCpusPicture) {
  const NanoVolume nano = makeNanoVolume(nanoBlobs(), GetParam());
  for (const double step : {0.5, 1.0, 3.0})
    expectNanoClose(makeNanoRenderer(nano, device_)->draw(nanoOptions(step)),
                    renderNano(nano, nanoOptions(step)));
}

TEST_P(NanoOnGpu, DrawsInBandsWhereMemoryIsShort) {
  const NanoVolume nano = makeNanoVolume(nanoBlobs(), GetParam());
  const std::uint64_t bound = nano.bytes + 240'000;  // the tables and a part of the pixels
  const auto renderer = makeNanoRenderer(nano, device_, {.maxBytes = bound});
  expectNanoClose(renderer->draw(nanoOptions()), renderNano(nano, nanoOptions()));
  EXPECT_LE(renderer->stats().deviceBytes, bound);
  EXPECT_THROW((void)makeNanoRenderer(nano, device_, {.maxBytes = 1000})->draw(nanoOptions()),
               DeviceError);
}

INSTANTIATE_TEST_SUITE_P(Values, NanoOnGpu,
                         testing::Values(NanoValues::kFloat, NanoValues::kFp4, NanoValues::kFp8,
                                         NanoValues::kFp16, NanoValues::kFpN));

}  // namespace
}  // namespace esvr::test
