// Plan: marching over bricks, which skips empty ones, agrees with float64 trilinear interpolation
// at every sample (reference_picture.h). The differences are those of render_field_test.cpp; the
// interpolation itself is float32, with errors of 1e-7 of the values. Then the two renderers are
// compared with each other.
//
// Several grids in one picture. The reference solves the equation of emission and absorption
// in float64: each segment is divided into many parts, in which the values are interpolated
// linearly, and the extinctions and emissions of the grids add up. Further: one grid, and a second
// one that is transparent or empty, look as a grid does by itself; the order of the grids does not
// matter; emission hides nothing. Fields and their decoded volumes give the same picture.
//
// The picture of a NanoVDB grid agrees with that of the same voxels marched in float64
// (renderVolume). Float32 positions have errors of 1e-5 voxel, so that a few samples fall into the
// next cell, and values have errors of 1e-5 of their range. Quantised values differ by half a step
// of 4, 8 or 16 bits of a leaf's range, which is up to 1 here. The cases have negative coordinates,
// empty space, bricks that touch at corners only, and a camera inside.

#include <gtest/gtest.h>

#include <cmath>
#include <iterator>
#include <utility>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/render.h"
#include "field/random_field.h"
#include "render/reference_picture.h"
#include "render/scenes.h"
#include "render/view.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

constexpr double kAskedOfBricks = 70.0;

/// A few bricks far apart, some with neighbours, with random values.
SparseVolume scattered(Coord shift = {}) {
  std::vector<Coord> corners{{0, 0, 0},   {0, 0, 8},    {8, 8, 8},
                             {40, 0, 16}, {16, 40, 32}, {0, 32, 0}};
  for (Coord& corner : corners) corner = corner + shift;
  return randomBricks(corners, 3);
}

double brickAgreement(const SparseVolume& volume, const RenderOptions& o) {
  const double farthest = length(difference(o.camera.eye, o.camera.center)) + 100.0;
  const SampledScene scene{[&](const Vec3& place) { return trilinear(volume, place); },
                           volume.background, farthest};
  return imagePsnr(referencePicture(scene, o), renderVolume(volume, o));
}

TEST(RenderVolume, AgreesWithADenseWalk) {
  const auto volume = scattered();
  EXPECT_GE(brickAgreement(volume, optionsFor(volume)), kAskedOfBricks);
  EXPECT_GE(brickAgreement(volume, optionsFor(volume, orthographic())), kAskedOfBricks);
}

TEST(RenderVolume, AgreesAlongAxesWhereSamplesLieOnTheFacesOfBricks) {
  const auto volume = scattered({-16, 8, -24});
  for (const Vec3& from : {Vec3{100, 0, 0}, Vec3{0, 0, -100}, Vec3{0, 100, 0}}) {
    RenderOptions o = optionsFor(volume, orthographic());
    o.resolution = {48, 48};
    o.camera.height = 96.0;  // a pixel is two voxels wide, so that rays pass through voxels
    o.camera.center = {8.0, 20.0, 0.0};
    o.camera.eye = sum(o.camera.center, from);
    o.camera.up = from[1] == 0.0 ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
    EXPECT_GE(brickAgreement(volume, o), kAskedOfBricks);
  }
}

TEST(RenderVolume, SlowVoxelsThatAreNoCubesAgreeWithADenseWalk) {
  const auto volume = scattered();
  for (const VoxelShape& voxel : {VoxelShape{{{{1, 0, 0}, {0, 1, 0}, {0, 0, 3}}}},
                                  VoxelShape{{{{-1, 0, 0}, {0, 2, 0}, {0, 0, 1}}}},
                                  VoxelShape{{{{1, 0, 0}, {0.5, 1, 0}, {0.2, -0.3, 1.5}}}}})
    for (const auto projection : {Projection::kPerspective, Projection::kOrthographic}) {
      RenderOptions o = optionsFor(volume, {.projection = projection, .voxel = voxel});
      EXPECT_GE(brickAgreement(volume, o), kAskedOfBricks);
    }
}

TEST(RenderVolume, CamerasThatAreFarAwaySeeTheVolume) {
  const auto volume = scattered();
  RenderOptions o = optionsFor(volume, orthographic());
  const Vec3 back = difference(o.camera.eye, o.camera.center);
  o.step = 0.1;
  const Image near = renderVolume(volume, o);
  for (const double times : {1e10, 1e18, 1e290}) {
    RenderOptions far = o;
    far.camera.eye = sum(o.camera.center, scaled(back, times));
    EXPECT_LE(largestDifference(renderVolume(volume, far), near), 0.05) << times;
    far.camera.projection = Projection::kPerspective;
    far.camera.fov = 1e-13;
    EXPECT_NO_THROW((void)renderVolume(volume, far)) << times;
  }
}

TEST(RenderVolume, AgreesFromInside) {
  const auto volume = scattered();
  const CameraWish inside{.eye = Vec3{9, 10, 11}, .center = Vec3{40, 12, 20}, .fov = 90.0};
  EXPECT_GE(brickAgreement(volume, optionsFor(volume, inside)), kAskedOfBricks);
}

TEST(RenderVolume, EmptySpaceIsTransparentWhateverItsOpacity) {
  auto volume = scattered();
  volume.background = 0.0f;
  RenderOptions o = optionsFor(volume);
  o.transfer.opacity = builtInOpacity("inverse");
  o.opacityLength = o.step;  // 1 - (1 - opacity)^0.1 is too steep at opacity 1 for a table
  EXPECT_GE(brickAgreement(volume, o), kAskedOfBricks);
  EXPECT_EQ(renderVolume(volume, o).rgba[3], 0.0f) << "a corner that no ray to the volume meets";
}

TEST(RenderVolume, IsTheSameForAnyNumberOfThreads) {
  const auto volume = scattered();
  expectSameOnAnyThreads([&] { return renderVolume(volume, optionsFor(volume)).rgba; });
}

TEST(RenderVolume, NoVoxelsGiveAnEmptyPicture) {
  expectTransparent(renderVolume(SparseVolume{}, optionsFor(scattered())));
}

TEST(Renderers, AgreeOnSmoothFields) {
  // For a blob with scale s, trilinear interpolation errs by up to 3/8 of the second derivative,
  // about 2 I / s^2. This is 0.7 % of the intensity for s = 10, and more for smaller scales. An
  // opacity of 1/20 reduces it, and most errors have the same sign, which gives 45 dB.
  const Field field =
      withoutNegatives(randomField({.count = 25, .smallest = 8.0, .aspect = 1.5, .kappa = 0.0f}));
  const SparseVolume volume = revoxelise(field, {.threshold = -1.0f});
  RenderOptions o = optionsFor(volume);
  o.transfer = rescaled(o.transfer, {0.0f, 5.0f});
  o.opacityLength = 20.0;
  o.between = Between::kSum;
  EXPECT_GE(imagePsnr(renderField(field, o), renderVolume(volume, o)), 45.0);
}

// ---- Several grids

/// Positions are rounded to float32, which moves samples by 1e-5 voxel (render_cells_test.cpp).
constexpr double kSamePicture = 80.0;
const Device kCpu{};
/// A segment takes the colors of both grids as mixed evenly. The error is a share of the square of
/// the segment's optical depth, which is up to -ln(0.1) / 20 = 0.115 for each grid here.
constexpr double kMixing = 5e-4;

struct ReferenceGrid {
  const SparseVolume& volume;
  Integrals integrals;
  bool absorbs;
};

/// Adds a part of a segment, whose values at its ends are given for each grid.
void addPart(const std::vector<ReferenceGrid>& grids, const std::vector<double>& from,
             const std::vector<double>& to, double length, Light& light) {
  Channels sum{};
  for (std::size_t g = 0; g < grids.size(); ++g) {
    const Channels mean = grids[g].integrals.meanBetween(from[g], to[g]);
    for (std::size_t c = 0; c < 3; ++c) sum[c] += mean[c];
    if (grids[g].absorbs) sum[3] += mean[3];
  }
  const double depth = sum[3] * length;
  const double weight = light.transmittance * (depth > 0.0 ? -std::expm1(-depth) / sum[3] : length);
  light.r += weight * sum[0], light.g += weight * sum[1], light.b += weight * sum[2];
  light.transmittance *= std::exp(-depth);
}

void addSegment(const std::vector<ReferenceGrid>& grids, const std::vector<double>& from,
                const std::vector<double>& to, double length, Light& light) {
  constexpr int kRayParts = 16;
  std::vector<double> a(from.size()), b(from.size());
  for (int p = 0; p < kRayParts; ++p) {
    for (std::size_t g = 0; g < from.size(); ++g) {
      a[g] = from[g] + (to[g] - from[g]) * p / kRayParts;
      b[g] = from[g] + (to[g] - from[g]) * (p + 1) / kRayParts;
    }
    addPart(grids, a, b, length / kRayParts, light);
  }
}

/// A segment between two samples of empty space is empty, whatever the background looks like; here
/// the background is transparent.
Image reference(const std::vector<const SparseVolume*>& volumes, const RenderOptions& o) {
  std::vector<ReferenceGrid> grids;
  for (std::size_t g = 0; g < volumes.size(); ++g)
    grids.push_back({*volumes[g],
                     {g == 0 ? o.transfer : o.further[g - 1].transfer, o.step / o.opacityLength},
                     g == 0 || o.further[g - 1].absorbs});
  const View view(o.camera, o.resolution);
  const double farthest = length(difference(o.camera.eye, o.camera.center)) + 100.0;
  Image image{o.resolution.width, o.resolution.height, {}};
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column) {
      const Ray ray = view.ray(column, row);
      Light light;
      const std::vector<double> empty(grids.size(), 0.0);
      std::vector<double> last = empty, change = empty;
      const auto valuesAt = [&](double sample) {
        std::vector<double> values = empty;  // those before the eye
        const Vec3 place = sum(ray.origin, scaled(ray.direction, sample * o.step));
        for (std::size_t g = 0; g < grids.size() && sample >= 0.0; ++g)
          values[g] = trilinear(grids[g].volume, place);
        return values;
      };
      for (int j = 0; j * o.step <= farthest; ++j) {
        const auto value = valuesAt(j);
        bool bends = false;
        for (std::size_t g = 0; g < grids.size(); ++g)
          bends =
              bends || grids[g].integrals.bends(last[g], value[g], change[g], light.transmittance);
        const int parts = bends ? 4 : 1;
        for (int p = 1; p <= parts; ++p) {
          const auto now = p == parts ? value : valuesAt(j - 1 + double(p) / parts);
          if (now != empty || last != empty) addSegment(grids, last, now, 1.0 / parts, light);
          for (std::size_t g = 0; g < grids.size(); ++g)
            change[g] = now[g] == 0.0 ? 0.0 : (now[g] - last[g]) * parts;
          last = now;
        }
      }
      for (const double v : {light.r, light.g, light.b, 1.0 - light.transmittance})
        image.rgba.push_back(float(v));
    }
  return image;
}

/// A transfer function whose opacity is 0 at the background.
TransferFunction clearAtZero(const char* colors) {
  TransferFunction transfer{builtInColorMap(colors), builtInOpacity("linear")};
  transfer.opacity = {{-1.0, 0.9}, {0.0, 0.0}, {1.0, 0.9}};
  return rescaled(transfer, {-1.0f, 1.0f});
}

/// A transfer function that leaves everything transparent.
TransferFunction transparent() { return {builtInColorMap("viridis"), {{0.0, 0.0}}}; }

/// Two volumes, and a picture in which the background is clear.
struct TwoVolumes {
  SparseVolume first = revoxelise(firstField(), kVoxelsOfGrids);
  SparseVolume second = revoxelise(secondField(), kVoxelsOfGrids);
  RenderOptions options = optionsForTwo();

  TwoVolumes() {
    options.transfer = clearAtZero("viridis");
    options.further = {{clearAtZero("inferno")}};
    options.minTransmittance = 0.0;
  }
  [[nodiscard]] Image drawn() const {
    return makeGridsRenderer({&first, &second}, kCpu)->draw(options);
  }
};

TEST(RenderGrids, SlowSolveTheEquationOfEmissionAndAbsorption) {
  TwoVolumes two;
  const auto error = [&] {
    return largestDifference(two.drawn(), reference({&two.first, &two.second}, two.options));
  };
  EXPECT_LE(error(), kMixing);
  two.options.step = 0.25;
  EXPECT_LE(error(), kMixing / 4.0) << "the error falls with the step";
}

TEST(RenderGrids, SlowSolveItForEmissionToo) {
  TwoVolumes two;
  two.options.further[0].absorbs = false;
  EXPECT_LE(largestDifference(two.drawn(), reference({&two.first, &two.second}, two.options)),
            kMixing);
}

TEST(RenderGrids, OneGridLooksAsByItself) {
  const Field field = firstField();
  const SparseVolume volume = revoxelise(field, kVoxelsOfGrids);
  for (const Classification classification :
       {Classification::kPreIntegrated, Classification::kPost}) {
    RenderOptions o = optionsForTwo();
    o.further.clear();
    o.classification = classification;
    const Image expected = renderVolume(volume, o);
    EXPECT_GE(imagePsnr(makeGridsRenderer({&volume}, kCpu)->draw(o), expected), kSamePicture);
    const DrawnField drawn{&field, kVoxelsOfGrids};
    EXPECT_GE(imagePsnr(makeGridsRenderer({drawn}, kCpu)->draw(o), expected), 70.0)
        << "voxels at the threshold may differ";
  }
}

TEST(RenderGrids, ATransparentGridChangesNothing) {
  TwoVolumes two;
  two.options.further[0].transfer = transparent();
  RenderOptions alone = two.options;
  alone.further.clear();
  EXPECT_GE(imagePsnr(two.drawn(), renderVolume(two.first, alone)), kSamePicture);
  EXPECT_GE(imagePsnr(two.drawn(), makeGridsRenderer({&two.first}, kCpu)->draw(alone)),
            kSamePicture)
      << "segments are divided where the values of any grid bend";
}

TEST(RenderGrids, AnEmptyGridChangesNothing) {
  TwoVolumes two;
  two.second = SparseVolume{};
  RenderOptions alone = two.options;
  alone.further.clear();
  const Image expected = makeGridsRenderer({&two.first}, kCpu)->draw(alone);
  EXPECT_EQ(two.drawn().rgba, expected.rgba);
  std::swap(two.first, two.second);
  std::swap(two.options.transfer, two.options.further[0].transfer);
  EXPECT_EQ(two.drawn().rgba, expected.rgba);
  two.second = SparseVolume{};
  expectTransparent(two.drawn());
}

TEST(RenderGrids, TheirOrderDoesNotMatter) {
  TwoVolumes two;
  const Image expected = two.drawn();
  std::swap(two.first, two.second);
  std::swap(two.options.transfer, two.options.further[0].transfer);
  EXPECT_GE(imagePsnr(two.drawn(), expected), kSamePicture);
}

TEST(RenderGrids, HalvesOfAnExtinctionAddUpToIt) {
  TwoVolumes two;
  two.second = two.first;
  two.options.further[0].transfer = two.options.transfer;
  two.options.opacityLength = 40.0;
  RenderOptions alone = two.options;
  alone.further.clear();
  alone.opacityLength = 20.0;
  EXPECT_LE(largestDifference(two.drawn(), renderVolume(two.first, alone)), 1e-4);
}

TEST(RenderGrids, EmissionHidesNothingAndAddsNoAlpha) {
  TwoVolumes two;
  two.options.further[0].absorbs = false;
  RenderOptions alone = two.options;
  alone.further.clear();
  const Image both = two.drawn(), first = makeGridsRenderer({&two.first}, kCpu)->draw(alone);
  double added = 0.0;
  for (std::size_t i = 0; i < both.rgba.size(); ++i) {
    const float more = both.rgba[i] - first.rgba[i];
    constexpr float kDivided = 1e-3f;  // segments are divided where the values of any grid bend
    ASSERT_GE(more, -kDivided);
    ASSERT_LE(more, i % 4 == 3 ? kDivided : 10.0f);
    added += more;
  }
  EXPECT_GT(added, 1.0);
}

TEST(RenderGrids, FieldsLookAsTheirVolumes) {
  const Field first = firstField(), second = secondField();
  const TwoVolumes two;
  const RenderOptions o = optionsForTwo();
  const std::vector<DrawnGrid> fields{DrawnField{&first, kVoxelsOfGrids},
                                      DrawnField{&second, kVoxelsOfGrids}};
  const Image expected = makeGridsRenderer({&two.first, &two.second}, kCpu)->draw(o);
  const auto drawn = makeGridsRenderer(fields, kCpu);
  EXPECT_GE(imagePsnr(drawn->draw(o), expected), 70.0) << "voxels at the threshold may differ";
  const Image once = drawn->draw(o);
  drawn->forget();
  EXPECT_EQ(drawn->draw(o).rgba, once.rgba);
}

TEST(RenderGrids, SlowAreClippedAndSeenFromInside) {
  TwoVolumes two;
  two.options.clip = PlaceBox{{20, 10, 5}, {45, 40, 30}};
  const Image clipped = two.drawn();
  RenderOptions alone = two.options;
  alone.further[0].transfer = transparent();
  const Image first = makeGridsRenderer({&two.first, &two.second}, kCpu)->draw(alone);
  alone.further.clear();
  EXPECT_GE(imagePsnr(first, renderVolume(two.first, alone)), kSamePicture);
  EXPECT_GT(largestDifference(clipped, first), 0.1);
  two.options.clip = PlaceBox{{500, 500, 500}, {501, 501, 501}};
  expectTransparent(two.drawn());

  two.options.clip.reset();
  two.options.camera =
      fitCamera({{0, 0, 0}, {79, 63, 59}},
                {.eye = Vec3{33.3, 21.7, 18.1}, .center = Vec3{0, 40, 3}, .fov = 120.0},
                two.options.resolution);
  EXPECT_LE(largestDifference(two.drawn(), reference({&two.first, &two.second}, two.options)),
            kMixing);
}

TEST(RenderGrids, FourGridsAreDrawn) {
  TwoVolumes two;
  RenderOptions four = two.options;
  four.opacityLength *= 2.0;
  four.further = {two.options.further[0], {two.options.transfer}, two.options.further[0]};
  const Image drawn =
      makeGridsRenderer({&two.first, &two.second, &two.first, &two.second}, kCpu)->draw(four);
  EXPECT_LE(largestDifference(drawn, two.drawn()), 1e-4) << "each grid is there twice";
}

TEST(RenderGrids, AreTheSameForAnyNumberOfThreads) {
  const TwoVolumes two;
  expectSameOnAnyThreads([&] { return two.drawn().rgba; });
}

TEST(RenderGrids, RefuseWhatTheyDoNotHave) {
  const TwoVolumes two;
  const auto renderer = makeGridsRenderer({&two.first, &two.second}, kCpu);
  RenderOptions o = two.options;
  o.further.clear();
  EXPECT_THROW((void)renderer->draw(o), UsageError) << "a look is missing";
  o = two.options, o.mode = RenderMode::kMaximum;
  EXPECT_THROW((void)renderer->draw(o), UsageError);
  o = two.options, o.shading = Shading{};
  EXPECT_THROW((void)renderer->draw(o), UsageError);
  EXPECT_THROW((void)renderVolume(two.first, two.options), UsageError) << "a look too many";
  EXPECT_THROW((void)makeGridsRenderer({}, kCpu), UsageError);
  EXPECT_THROW((void)makeGridsRenderer(std::vector<DrawnGrid>(5, &two.first), kCpu), UsageError);
}

// ---- NanoVDB

constexpr Box kNanoBox{{-20, -20, -20}, {59, 59, 59}};

VolumeGrid nanoBlobs(Coord origin = {-20, -20, -20}) {
  VolumeGrid grid;
  grid.descriptor.transform = uniformTransform(1.0);
  const Field field = randomField({.count = 30, .extent = 70.0, .smallest = 1.0, .origin = origin});
  grid.volume = revoxelise(field, {.threshold = 0.05f});
  return grid;
}

RenderOptions nanoOptions(const CameraWish& wish = {}) {
  RenderOptions o = pictureOf(kNanoBox, {70, 50}, 8.0, wish);
  o.lod = LevelOfDetail::kOff;
  return o;
}

void expectTheVolumesPicture(const VolumeGrid& grid, NanoValues values, const RenderOptions& o,
                             double tolerance) {
  const Image expected = renderVolume(grid.volume, o);
  expectAnyLight(expected);
  const NanoVolume nano = makeNanoVolume(grid, values);
  EXPECT_LE(largestDifference(makeNanoRenderer(nano, {DeviceKind::kCpu})->draw(o), expected),
            tolerance);
}

TEST(RenderNano, DrawsTheVolumesPicture) {
  for (const CameraWish& wish : {CameraWish{}, orthographic(), inside()})
    expectTheVolumesPicture(nanoBlobs(), NanoValues::kFloat, nanoOptions(wish), 1e-3);
}

TEST(RenderNano, AgreesForOtherSteps) {
  for (const double step : {0.3, 2.7}) {
    RenderOptions o = nanoOptions();
    o.step = step;
    expectTheVolumesPicture(nanoBlobs(), NanoValues::kFloat, o, 1e-3);
  }
}

TEST(RenderNano, StepsOverAllOfAFarEmptySpace) {
  VolumeGrid grid = nanoBlobs();
  auto bricks = bricksOf(grid.volume);
  std::ranges::move(bricksOf(nanoBlobs({5000, -20, -20}).volume), std::back_inserter(bricks));
  grid.volume = makeVolume(std::move(bricks), 0.0f);
  const RenderOptions o =
      nanoOptions({.eye = Vec3{-200, 20, 20}, .center = Vec3{0, 20, 20}, .fov = 20.0});
  expectTheVolumesPicture(grid, NanoValues::kFloat, o, 1e-3);
}

/// The background is a quantised value too, so it is not exactly empty; the opacity begins at it.
TEST(RenderNano, QuantisedValuesAreCloseBy) {
  VolumeGrid grid = nanoBlobs();
  for (float& v : grid.volume.values) v = std::abs(v);
  RenderOptions o = nanoOptions();
  o.transfer = rescaled(o.transfer, {0.0f, 1.0f});
  expectTheVolumesPicture(grid, NanoValues::kFp16, o, 2e-3);
  expectTheVolumesPicture(grid, NanoValues::kFp8, o, 0.02);
  expectTheVolumesPicture(grid, NanoValues::kFpN, o, 0.1);
  expectTheVolumesPicture(grid, NanoValues::kFp4, o, 0.2);
}

TEST(RenderNano, AnEmptyGridIsTransparent) {
  VolumeGrid grid;
  grid.descriptor.transform = uniformTransform(1.0);
  const NanoVolume nano = makeNanoVolume(grid, NanoValues::kFloat);
  expectTransparent(renderNano(nano, nanoOptions()));
}

}  // namespace

}  // namespace esvr::test
