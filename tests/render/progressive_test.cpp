// Plan: the last pass of a progressive picture has the bits of the picture. Every pass has its size
// and shows the same view: a smooth picture is nearly right after the first pass, and passes become
// better, also if the sides are not multiples of 8. The budget decides how many passes a call draws:
// this is tested with a renderer that only waits. A cancelled pass leaves the last one.
#include "esvr/render.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <thread>

#include "esvr/error.h"
#include "esvr/field.h"
#include "field/random_field.h"
#include "render/reference_picture.h"
#include "render/scenes.h"

namespace esvr::test {
namespace {

RenderOptions options(Resolution resolution = {96, 64}) {
  return pictureOf(kFieldBox, resolution, 20.0);
}

Field blobs() { return randomField({.count = 20, .smallest = 5.0}); }

TEST(ProgressivePicture, EndsWithThePicture) {
  const Field field = blobs();
  for (const Resolution r : {Resolution{96, 64}, Resolution{61, 45}, Resolution{3, 1}}) {
    const auto renderer = makeFieldRenderer(field, {DeviceKind::kCpu});
    const Image expected = renderer->draw(options(r));
    ProgressivePicture picture(*renderer, options(r));
    EXPECT_FALSE(picture.image().has_value());
    double before = 0.0;
    for (int pass = 0; !picture.complete(); ++pass) {
      EXPECT_EQ(picture.refine(0.0), pass == 3);
      ASSERT_EQ(picture.image()->width, r.width);
      ASSERT_EQ(picture.image()->rgba.size(), expected.rgba.size());
      if (r.width < 60) continue;  // one pixel says little
      const double psnr = imagePsnr(expected, *picture.image());
      EXPECT_GT(psnr, std::max(before, 20.0)) << pass;
      before = psnr;
    }
    EXPECT_EQ(picture.image()->rgba, expected.rgba);
    EXPECT_TRUE(picture.refine(1.0)) << "nothing is left to do";
  }
}

/// Gives pictures of the value 1 after a call with their sizes.
class PlainRenderer final : public Renderer {
 public:
  explicit PlainRenderer(std::function<void(Resolution)> before) : before_(std::move(before)) {}
  Image draw(const RenderOptions& o) override {
    const Resolution r = o.resolution;
    before_(r);
    return {
        r.width, r.height,
        std::vector<float>(std::size_t(4) * std::size_t(r.width) * std::size_t(r.height), 1.0f)};
  }
  void drawOnDevice(const RenderOptions& o) override { (void)draw(o); }
  FrameStats stats() const override { return {}; }

 private:
  std::function<void(Resolution)> before_;
};

void waitForEachPixel(Resolution r) {
  std::this_thread::sleep_for(std::chrono::microseconds(r.width * r.height));
}

TEST(ProgressivePicture, KeepsToItsBudget) {
  // The passes wait for 6, 25, 100 and 410 ms; other work and late wake-ups make them longer only.
  // A loaded machine can thus leave out a pass, but never draw one more.
  PlainRenderer renderer(waitForEachPixel);
  ProgressivePicture picture(renderer, options({640, 640}));
  EXPECT_FALSE(picture.refine(0.3)) << "the last pass alone takes 0.41 s";
  EXPECT_FALSE(picture.complete());
  EXPECT_TRUE(picture.image());
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(picture.refine(1000.0));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(400));
}

TEST(ProgressivePicture, ACancelledPassLeavesTheLastOne) {
  const Field field = blobs();
  const auto renderer = makeFieldRenderer(field, {DeviceKind::kCpu});
  CancelToken token;
  RenderOptions o = options();
  o.cancel = &token;
  ProgressivePicture picture(*renderer, o);
  picture.refine(0.0);
  const std::vector<float> first = picture.image()->rgba;
  token.cancel();
  EXPECT_THROW(picture.refine(10.0), Cancelled);
  EXPECT_EQ(picture.image()->rgba, first);
  EXPECT_FALSE(picture.complete());
}

TEST(ProgressivePicture, AFailureLeavesTheLastPassOfTheSameCall) {
  PlainRenderer renderer([left = 2](Resolution) mutable {
    if (left-- == 0) throw DeviceError("the device is gone");
  });
  ProgressivePicture picture(renderer, options());
  EXPECT_THROW(picture.refine(1000.0), DeviceError);
  ASSERT_TRUE(picture.image());
  EXPECT_EQ(picture.image()->width, 96);
  EXPECT_EQ(picture.image()->rgba, std::vector<float>(std::size_t(4) * 96 * 64, 1.0f));
}

TEST(ProgressivePicture, RefusesWrongOptionsAtOnce) {
  PlainRenderer renderer(waitForEachPixel);
  RenderOptions o = options();
  o.step = -1.0;
  EXPECT_THROW(ProgressivePicture(renderer, o), UsageError);
}

TEST(Renderer, IsMadeAndUsedOnSeveralThreads) {
  const Field field = blobs();
  const Image expected = makeFieldRenderer(field, {DeviceKind::kCpu})->draw(options());
  std::atomic<int> equal = 0;
  std::vector<std::thread> threads;
  for (int n = 0; n < 4; ++n)
    threads.emplace_back([&] {
      equal += makeFieldRenderer(field, {DeviceKind::kCpu})->draw(options()).rgba == expected.rgba;
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(equal, 4);
}

}  // namespace
}  // namespace esvr::test
