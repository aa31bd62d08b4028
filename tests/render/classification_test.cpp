// Plan: a tilted slab and a tilted cube have faces whose true picture is constant along a face, so
// the variance of their pixels measures the stripes that sampling leaves there. Pre-integration
// must leave a hundredth of the power that post-classification leaves. With short steps both rules
// draw the same picture. The rule itself is tested on sequences of values: parts that are joined
// are as good as one part, and it does not matter which samples in empty space are left out.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "esvr/render.h"
#include "field/random_field.h"
#include "render/brick_scene.h"
#include "render/reference_picture.h"
#include "render/sample_rule.h"
#include "render/vector.h"

namespace esvr::test {
namespace {

constexpr int kSide = 48;  // voxels
constexpr double kMiddle = kSide / 2.0;
constexpr double kLessPower = 100.0;

/// A volume whose voxels have the values of a function of their places.
template <class Value>
SparseVolume sampled(float background, Value&& value) {
  std::vector<BrickInput> bricks;
  for (int b = 0; b < 6 * 6 * 6; ++b) {
    BrickInput brick{Coord{b / 36, b / 6 % 6, b % 6} * kBrickSide, {}, {}};
    for (int i = 0; i < kBrickVoxels; ++i) {
      const Coord at = brick.corner + Coord{i / 64, i / 8 % 8, i % 8};
      brick.values[std::size_t(i)] = float(value(Vec3{double(at.x), double(at.y), double(at.z)}));
    }
    brick.active.setAll();
    bricks.push_back(brick);
  }
  return makeVolume(std::move(bricks), background);
}

/// A slab of 20 voxels whose values fall from 1 to 0 within 3 voxels on both sides.
SparseVolume slab() {
  const Vec3 normal = unit({0.3, 0.1, 1.0});
  return sampled(0.0f, [&](const Vec3& p) {
    const double away = std::abs(inner(normal, difference(p, {kMiddle, kMiddle, kMiddle})));
    return std::clamp((10.0 - away) / 3.0 + 0.5, 0.0, 1.0);
  });
}

/// The level set of a cube with sides of 24 voxels, with a narrow band of 3 voxels to each side.
SparseVolume tiltedCube() {
  const Vec3 x = unit({1.0, 0.2, 0.3}), z = unit(cross(x, {0.1, 1.0, 0.2})), y = cross(z, x);
  return sampled(3.0f, [&](const Vec3& p) {
    const Vec3 d = difference(p, {kMiddle, kMiddle, kMiddle});
    const double away =
        std::max({std::abs(inner(x, d)), std::abs(inner(y, d)), std::abs(inner(z, d))});
    return std::clamp(away - 12.0, -3.0, 3.0);
  });
}

/// The picture of a square of some voxels in the middle of the volume.
RenderOptions closeUp(double voxels, const TransferFunction& transfer) {
  RenderOptions o;
  o.resolution = {64, 64};
  o.camera = fitCamera({{0, 0, 0}, {kSide - 1, kSide - 1, kSide - 1}},
                       {.projection = Projection::kOrthographic}, o.resolution);
  o.camera.center = {kMiddle, kMiddle, kMiddle};
  o.camera.eye = {kMiddle, kMiddle, 100.37};
  o.camera.up = {0, 1, 0};
  o.camera.height = voxels;
  o.transfer = transfer;
  return o;
}

/// The power of all that is not constant in a channel of a picture.
double variance(const Image& image, std::size_t channel) {
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = channel; i < image.rgba.size(); i += 4)
    sum += image.rgba[i], squares += double(image.rgba[i]) * image.rgba[i];
  const double mean = 4.0 * sum / double(image.rgba.size());
  return 4.0 * squares / double(image.rgba.size()) - mean * mean;
}

double stripes(const SparseVolume& volume, RenderOptions o, Classification classification) {
  o.classification = classification;
  return variance(renderVolume(volume, o), 1);
}

void expectFewStripes(const SparseVolume& volume, const RenderOptions& o) {
  const double post = stripes(volume, o, Classification::kPost);
  EXPECT_GT(post, 1e-4) << "without stripes there is nothing to compare";
  EXPECT_LE(stripes(volume, o, Classification::kPreIntegrated), post / kLessPower);
}

TEST(Classification, AFlatSurfaceHasNoStripes) {
  for (const char* colors : {"viridis", "grayscale"})
    for (const OpacityCurve& curve :
         {builtInOpacity("step"), OpacityCurve{{0.0, 0.0}, {0.45, 0.0}, {0.55, 0.99}, {1.0, 1.0}}})
      expectFewStripes(slab(), closeUp(24.0, {builtInColorMap(colors), curve}));
}

TEST(Classification, ALevelSetHasNoMoire) {
  const TransferFunction surface =
      rescaled({builtInColorMap("viridis"), {{0.0, 1.0}, {0.5, 1.0}, {0.5, 0.0}, {1.0, 0.0}}},
               {-3.0f, 3.0f});
  expectFewStripes(tiltedCube(), closeUp(8.0, surface));
}

TEST(Classification, BothRulesAgreeAtShortSteps) {
  RenderOptions o = closeUp(60.0, {builtInColorMap("viridis"), builtInOpacity("smoke")});
  o.resolution = {24, 24};
  const SparseVolume volume = slab();
  const auto difference = [&](double step) {
    o.step = step, o.minTransmittance = 0.0;
    o.classification = Classification::kPost;
    const Image post = renderVolume(volume, o);
    o.classification = Classification::kPreIntegrated;
    return largestDifference(renderVolume(volume, o), post);
  };
  EXPECT_GT(difference(1.0), 0.01);
  EXPECT_LE(difference(0.02), 1e-3);
}

TEST(Classification, BricksThatHoldOnlyTheBackgroundChangeNothing) {
  const SparseVolume volume = randomBricks({{0, 0, 0}, {16, 8, 24}}, 11, 0.5f);
  std::vector<BrickInput> bricks;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    BrickInput brick{volume.brickCorner(b), {}, volume.active[b]};
    std::copy_n(volume.brickValues(b).begin(), kBrickVoxels, brick.values.begin());
    bricks.push_back(brick);
  }
  for (const Coord corner : {Coord{8, 0, 0}, Coord{8, 8, 16}, Coord{0, 0, 8}, Coord{24, 8, 24}}) {
    bricks.push_back({corner, {}, {}});
    bricks.back().values.fill(0.5f);
  }
  const RenderOptions o = optionsFor(volume);
  EXPECT_LE(largestDifference(renderVolume(makeVolume(std::move(bricks), 0.5f), o),
                              renderVolume(volume, o)),
            1e-6);
}

/// The samples of a ray that are not empty space.
struct Sample {
  std::uint32_t number;
  float value;
};

std::vector<Sample> samplesWithGaps(std::uint64_t seed) {
  Random random(seed);
  std::vector<Sample> samples;
  for (std::uint32_t n = 0; n < 60; ++n)
    if (random(0.0, 1.0) < 0.8) samples.push_back({n, float(random(0.1, 1.0))});
  return samples;
}

struct Ruled {
  explicit Ruled(RenderMode mode, Classification classification = Classification::kPreIntegrated) {
    options.mode = mode, options.classification = classification;
    options.transfer = {builtInColorMap("turbo"), builtInOpacity("linear")};
    options.opacityLength = 10.0;
    table.emplace(options.transfer, samplingOf(options));
  }
  [[nodiscard]] SampleRule rule() const { return sampleRule(options, table->view(), 0.0f); }
  void add(RayState& ray, const Sample& s) const {
    rule().add(ray, s.value, {float(s.number), s.number});
  }

  RenderOptions options;
  std::optional<TransferTable> table;
};

void expectSame(const PixelColor& a, const PixelColor& b, float tolerance = 1e-5f) {
  EXPECT_NEAR(a.r, b.r, tolerance);
  EXPECT_NEAR(a.g, b.g, tolerance);
  EXPECT_NEAR(a.b, b.b, tolerance);
  EXPECT_NEAR(a.alpha, b.alpha, tolerance);
}

/// Divides the samples at the given numbers, and joins the parts.
PixelColor joined(const Ruled& ruled, const std::vector<Sample>& samples,
                  const std::vector<std::uint32_t>& ends) {
  RayState ray, part;
  std::size_t next = 0;
  for (const Sample& s : samples) {
    for (; next < ends.size() && s.number >= ends[next]; ++next) {
      if (next == 0) ray = part;
      if (next > 0) ruled.rule().join(ray, part);
      part = RayState::behind();
    }
    ruled.add(part, s);
  }
  if (!ends.empty()) ruled.rule().join(ray, part);
  return ruled.rule().finished(ends.empty() ? part : ray);
}

TEST(SampleRule, PartsThatAreJoinedAreTheWholeRay) {
  for (const auto classification : {Classification::kPreIntegrated, Classification::kPost})
    for (const auto mode : {RenderMode::kComposite, RenderMode::kMaximum, RenderMode::kAverage}) {
      const Ruled ruled(mode, classification);
      for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const auto samples = samplesWithGaps(seed);
        const PixelColor whole = joined(ruled, samples, {});
        expectSame(joined(ruled, samples, {30}), whole);
        expectSame(joined(ruled, samples, {1, 7, 8, 9, 20, 20, 45}), whole);
      }
    }
}

TEST(SampleRule, PartsBehindARayThatHasNoSamplesBeginIt) {
  const Ruled ruled(RenderMode::kComposite);
  RayState ray, front = RayState::behind(), next = RayState::behind();
  const RayState none = RayState::behind();
  for (const std::uint32_t n : {3u, 4u}) ruled.add(front, {n, 0.5f});
  ruled.add(next, {5u, 0.75f});
  RayState both = none;
  ruled.rule().join(both, front), ruled.rule().join(both, none), ruled.rule().join(both, next);
  ruled.rule().join(ray, none), ruled.rule().join(ray, both);
  const std::vector<Sample> samples{{3u, 0.5f}, {4u, 0.5f}, {5u, 0.75f}};
  expectSame(ruled.rule().finished(ray), joined(ruled, samples, {}));
}

TEST(SampleRule, EmptySpaceIsEnteredAndLeftAtTheBackground) {
  const Ruled ruled(RenderMode::kComposite);
  const auto& segment = ruled.table->view().segments;
  const auto left = [&](float a, float b) { return 1.0f - segment(a, b).alpha; };
  const auto alpha = [&](const std::vector<Sample>& s) { return joined(ruled, s, {}).alpha; };
  EXPECT_EQ(alpha({}), 0.0f);
  EXPECT_NEAR(alpha({{4, 0.5f}}), 1.0f - left(0, 0.5f) * left(0.5f, 0), 1e-6);
  EXPECT_NEAR(alpha({{0, 0.5f}, {1, 0.9f}}),
              1.0f - left(0, 0.5f) * left(0.5f, 0.9f) * left(0.9f, 0), 1e-6);
  EXPECT_NEAR(alpha({{0, 0.5f}, {2, 0.9f}}),
              1.0f - left(0, 0.5f) * left(0.5f, 0) * left(0, 0.9f) * left(0.9f, 0), 1e-6);
}

TEST(SampleRule, ADistanceIsTheEndOfTheSegmentThatTakesHalfOfTheLight) {
  Ruled ruled(RenderMode::kDepth);
  ruled.options.opacityLength = 1.0;
  ruled.table.emplace(ruled.options.transfer, samplingOf(ruled.options));
  const auto depth = [&](const std::vector<Sample>& s) { return joined(ruled, s, {}); };
  EXPECT_EQ(depth({{7, 0.1f}}).alpha, 0.0f);
  EXPECT_EQ(depth({{7, 0.8f}}).r, 7.0f + 1.0f) << "the ray loses 45 % on the way in";
  EXPECT_EQ(depth({{7, 0.1f}, {8, 1.0f}, {9, 0.5f}}).r, 8.0f);
  EXPECT_EQ(depth({{7, 0.8f}, {12, 1.0f}}).r, 8.0f);
}

}  // namespace
}  // namespace esvr::test
