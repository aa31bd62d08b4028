// Plan: pictures with Between::kVoxels agree with those of the voxels that revoxelise() makes,
// drawn by renderVolume, for cameras, steps, zooms, shapes and rules. Voxels differ by rounding,
// about 1e-6 of the sum of the intensities that reach them. Samples differ by the rounding of
// positions to float32, 1e-5 voxel, which counts a few times as much at the sharp edges of a kappa
// of 12 and above. The tests require 80 dB; a missed voxel or a sample of another cell costs more.
// If a rule has a threshold, a voxel at the threshold may be active in one picture only: 70 dB. Coarser
// levels are sums of wider ellipsoids and not means of voxels. Both are compared with pictures of 4 x 4
// rays a pixel of level 0, whose differences from them are mostly those of any picture with one ray.
//
// The last pass of a progressive picture has the bits of the picture. Every pass has its size
// and shows the same view: a smooth picture is nearly right after the first pass, and passes become
// better, also if the sides are not multiples of 8. The budget decides how many passes a call draws:
// this is tested with a renderer that only waits. A cancelled pass leaves the last one.

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <string>
#include <thread>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/render.h"
#include "field/random_field.h"
#include "render/reference_picture.h"
#include "render/render_cells.h"
#include "render/scenes.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

constexpr double kAskedOfCells = 80.0, kAskedByThreshold = 70.0, kAskedOfCoarser = 38.0;

RenderOptions cellOptions(const CameraWish& wish = {}, Resolution resolution = {50, 37}) {
  return pictureOf(kFieldBox, resolution, 8.0, wish);
}

double voxelAgreement(const Field& field, const RenderOptions& o,
                      const RevoxeliseOptions& rule = {}) {
  const Image drawn = renderField(field, o, rule);
  expectAnyLight(drawn);
  return imagePsnr(renderVolume(revoxelise(field, rule), o), drawn);
}

TEST(RenderCells, DrawsTheVoxelsPictureFromEveryDirection) {
  const Field field = randomField({.count = 200});
  for (int turn = 0; turn < 8; ++turn) {
    RenderOptions o = cellOptions();
    o.camera = turned(o.camera, 45.0 * turn + 3.0);
    EXPECT_GE(voxelAgreement(field, o), kAskedOfCells) << turn;
    o.camera = turned(cellOptions(orthographic()).camera, 45.0 * turn);
    EXPECT_GE(voxelAgreement(field, o), kAskedOfCells) << turn << ", along an axis and across";
  }
  for (const Vec3 eye : {Vec3{20, 150, 20}, Vec3{20, -110, 20}})
    EXPECT_GE(voxelAgreement(field, cellOptions({.eye = eye, .up = Vec3{0, 0, 1}})), kAskedOfCells);
}

TEST(RenderCells, DrawsTheVoxelsPictureFromInside) {
  for (const double fov : {80.0, 170.0}) {
    RenderOptions o = cellOptions(inside(fov));
    o.lod = LevelOfDetail::kOff;
    EXPECT_GE(voxelAgreement(randomField({.count = 200}), o), kAskedOfCells) << fov;
  }
}

TEST(RenderCells, DrawsTheVoxelsPictureFromFarAway) {
  EXPECT_GE(voxelAgreement(randomField({.count = 200}), cellOptions(farAway())), kAskedOfCells);
}

TEST(RenderCells, DrawsTheVoxelsPictureAtEveryStep) {
  const Field field = randomField({.count = 200});
  for (const double step : {0.1, 0.5, 1.0, 2.5, 7.0}) {
    RenderOptions o = cellOptions();
    o.step = step;
    EXPECT_GE(voxelAgreement(field, o), kAskedOfCells) << step;
  }
  RenderOptions o = cellOptions();
  o.step = 60.0;  // most rays have one sample in the volume
  o.transfer.opacity = {{0.0, 0.5}};
  o.opacityLength = 60.0;
  EXPECT_GE(voxelAgreement(randomField({.count = 2000}), o), kAskedOfCells);
}

TEST(RenderCells, DrawsTheVoxelsPictureAtEveryZoom) {
  const Field field = randomField({.count = 200});
  for (const double times : {0.02, 0.3, 2.0, 10.0, 100.0}) {
    RenderOptions o = cellOptions(orthographic());
    o.camera.height *= times;
    o.lod = LevelOfDetail::kOff;
    // Samples may lie exactly at voxels here. Rounding then decides whether a sample beside a voxel
    // of the background is empty, which must not matter.
    o.transfer.opacity = {{-1.0, 1.0}, {0.0, 0.0}, {1.0, 1.0}};
    EXPECT_GE(imagePsnr(renderVolume(revoxelise(field, {}), o), renderField(field, o)),
              kAskedOfCells)
        << times;
  }
}

TEST(RenderCells, DrawsTheVoxelsPictureOfSmallAndThinEllipsoids) {
  EXPECT_GE(
      voxelAgreement(randomField({.count = 4000, .smallest = 0.15, .aspect = 3.0}), cellOptions()),
      kAskedOfCells);
  EXPECT_GE(
      voxelAgreement(randomField({.count = 200, .smallest = 0.1, .aspect = 200.0}), cellOptions()),
      kAskedOfCells);
  for (const float kappa : {-3.0f, 0.0f, 12.0f})
    EXPECT_GE(voxelAgreement(randomField({.count = 100, .kappa = kappa}), cellOptions()),
              kAskedOfCells)
        << kappa;
}

TEST(RenderCells, DrawsOneEllipsoidThatCoversEverything) {
  // The error is that of float32 at distances of hundreds of voxels: 1e-5.
  EXPECT_GE(voxelAgreement(oneEllipsoid(60.0, 0.3f, 1.5), cellOptions()), kAskedOfCells);
}

TEST(RenderCells, DrawsABackgroundSeveralChunksAndKappas) {
  Field field = twoChunks();
  field.chunks[0].ellipsoids.kappa.assign(20, 1.0f);
  field.chunks[0].ellipsoids.kappa[3] = 20.0f;
  field.chunks[1].ellipsoids.kappa.assign(20, 4.0f);
  EXPECT_GE(voxelAgreement(field, cellOptions()), kAskedOfCells);
}

TEST(RenderCells, DrawsByTheRuleOfTheVoxels) {
  const Field field = randomField({.count = 200});
  EXPECT_GE(voxelAgreement(field, cellOptions(), {.threshold = 0.2f}), kAskedByThreshold);
  EXPECT_GE(voxelAgreement(field, cellOptions(), {.range = ValueRange{-0.3f, 0.4f}}),
            kAskedOfCells);
  EXPECT_GE(
      voxelAgreement(field, cellOptions(), {.tone = {0.1f}, .range = ValueRange{-1.0f, 1.0f}}),
      kAskedOfCells);
}

// Half of the voxels of each brick are in its mask, and the box cuts through bricks. All voxels of
// the mask are active, so that rounding decides about none.
TEST(RenderCells, DrawsTheVoxelsOfMasksWithinABox) {
  const Field field = randomField({.count = 200});
  const Box box{{3, 0, 0}, {30, 22, 39}};
  const HalfMasks masked(field, {{0, 0, 0}, {23, 39, 39}});
  const RenderOptions far = pictureOf({{-20, -20, -20}, {60, 60, 60}}, {20, 15}, 8.0);
  for (const RevoxeliseOptions& rule : {RevoxeliseOptions{.box = box}, masked.within(box)}) {
    EXPECT_GE(voxelAgreement(field, cellOptions(), rule), kAskedOfCells);
    EXPECT_GE(voxelAgreement(field, far, rule), kAskedOfCells) << "means of coarser levels";
    EXPECT_LT(imagePsnr(renderField(field, cellOptions(), rule), renderField(field, cellOptions())),
              40.0);
  }
}

TEST(RenderCells, DrawsVoxelsThatAreAlwaysActive) {
  const Field field = randomField({.count = 200});
  std::vector<Coord> always;
  for (std::int32_t n = 0; n < 30; ++n) always.push_back({n, 10 + n % 7, 20});
  const RevoxeliseOptions none{.threshold = 100.0f};
  RevoxeliseOptions some = none;
  some.alwaysActive = always;
  EXPECT_GE(voxelAgreement(field, cellOptions(), some), kAskedByThreshold);
  EXPECT_LT(
      imagePsnr(renderField(field, cellOptions(), some), renderField(field, cellOptions(), none)),
      60.0);
}

TEST(RenderCells, DrawsEllipsoidsThatLieFarApart) {
  const Field field = puffsFarApart();
  const SparseVolume volume = revoxelise(field, {});
  const auto renderer = makeFieldRenderer(field, Device{});
  for (const std::size_t i : {0u, 17u, 59u}) {
    RenderOptions o = cellOptions();
    lookAt(field, i, o.camera);
    const Image expected = renderVolume(volume, o), drawn = renderer->draw(o);
    EXPECT_GE(imagePsnr(expected, drawn), kAskedOfCells);
    EXPECT_GT(drawn.rgba[4 * (18 * 50 + 25) + 3], 0.1f) << "the puff in the middle";
    o.between = Between::kSum;
    EXPECT_GE(imagePsnr(expected, renderer->draw(o)), 20.0) << "roughly";
  }
  RenderOptions all = cellOptions();
  all.camera = fitCamera(activeBox(volume), {}, all.resolution);
  EXPECT_GE(imagePsnr(renderVolume(volume, all), renderer->draw(all)), kAskedOfCells);
}

TEST(RenderCells, IsTheSameForAnyNumberOfThreads) {
  const Field field = randomField({.count = 300});
  const RenderOptions o = cellOptions({}, {130, 70});
  expectSameOnAnyThreads([&] { return renderField(field, o).rgba; });
}

// Levels of detail.

/// A cloud of 120 voxels in pixels of 3.5 voxels of a level.
struct FarCloud {
  Field field = randomField({.count = 400, .extent = 120.0, .smallest = 1.5, .kappa = 0.3f});
  RenderOptions options;

  explicit FarCloud(int level) {
    for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
    field.chunks[0].origin = {-64, 16, 8};
    constexpr Box kCloud{{-64, 16, 8}, {55, 135, 127}};
    options = cellOptions(orthographic(), {24, 24});
    options.camera = fitCamera(kCloud, orthographic(), options.resolution);
    options.camera.height = 24 * 3.5 * double(1 << level);
    options.opacityLength = 200.0;
  }
  [[nodiscard]] Image manyRays(const RevoxeliseOptions& rule) const {
    RenderOptions many = options;
    many.lod = LevelOfDetail::kOff;
    many.resolution = {4 * options.resolution.width, 4 * options.resolution.height};
    return meansOfSquares(renderField(field, many, rule), 4);
  }
};

TEST(RenderCells, CoarserLevelsAreAsGoodAsMeansOfVoxels) {
  const RevoxeliseOptions plain, ofRule{.tone = {0.3f},
                                        .threshold = 0.05f,
                                        .range = ValueRange{0.0f, 1.5f},
                                        .box = {{-50, 20, 9}, {50, 130, 120}}};
  for (const RevoxeliseOptions& rule : {plain, ofRule})
    for (const int level : {1, 2, 3}) {
      const FarCloud cloud(level);
      const Image expected = cloud.manyRays(rule);
      const Image sums = renderField(cloud.field, cloud.options, rule);
      const Image means = renderVolume(revoxelise(cloud.field, rule), cloud.options);
      EXPECT_GE(imagePsnr(expected, sums), imagePsnr(expected, means) - 0.5) << level;
      if (!rule.tone.isOn()) {
        EXPECT_GE(imagePsnr(means, sums), kAskedOfCoarser) << level;
      }
      EXPECT_NE(means.rgba, sums.rgba) << "levels must be at work";
    }
}

TEST(RenderCells, CoarserLevelsNeedNothingOfLevelZero) {
  const FarCloud cloud(2);
  LazyCells cells(cloud.field, {});
  const Image far = renderCells(cells, cloud.options);
  EXPECT_TRUE(cells.isPrepared(2));
  EXPECT_FALSE(cells.isPrepared(0) || cells.isPrepared(1));
  RenderOptions near = cloud.options;
  near.lod = LevelOfDetail::kOff;
  const Image fine = renderCells(cells, near);
  EXPECT_TRUE(cells.isPrepared(0));
  EXPECT_EQ(renderCells(cells, cloud.options).rgba, far.rgba) << "whatever was decoded before";
  EXPECT_EQ(renderField(cloud.field, near).rgba, fine.rgba);
}

TEST(RenderCells, CoarserLevelsOfMasksAreMeans) {
  const FarCloud cloud(2);
  const auto bricks = reachedBricks(cloud.field);
  const RevoxeliseOptions rule{.bricks = bricks, .restrictToBricks = true};
  EXPECT_GE(imagePsnr(renderVolume(revoxelise(cloud.field, rule), cloud.options),
                      renderField(cloud.field, cloud.options, rule)),
            kAskedOfCells);
}

TEST(RenderCells, CoarserLevelsAreTheSameForAnyNumberOfThreads) {
  const FarCloud cloud(1);
  expectSameOnAnyThreads([&] { return renderField(cloud.field, cloud.options).rgba; });
}

TEST(RenderCells, NothingToSeeIsTransparent) {
  expectTransparent(renderField(randomField({}), cellOptions(away())));
  expectTransparent(renderField(Field{}, cellOptions()));
}

// ---- Pictures in passes

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
