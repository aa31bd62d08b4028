// Plan: the voxels of a field are decoded when a ray asks for them. The pictures must have the same
// bits whatever was decoded before, in any order, and with memory for a part of a picture's bricks
// only; channels agree with the CPU's picture to within 1/255, and so do those of volumes. Bricks that
// the decoder makes on a GPU are compared with the definition in float64.
//
// Pictures of several grids on a GPU agree with those on the CPU to within 1/255, for fields,
// volumes and both together, and have the same bits whatever was decoded before and however little
// memory there is for bricks.
//
// The picture of a CUDA device that marches through a NanoVDB grid agrees with the CPU's to
// within 1/255 of a channel, for each value type, and in bands if memory is short.
//
// A picture for which the device has too little memory ends with an error that says so, and
// the renderer draws again afterwards. Slots that bricks leave are chosen in the order of their
// last reading, and only those that have an owner.

#include <cuda_runtime_api.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/render.h"
#include "field/random_field.h"
#include "render/cuda/cell_store.h"
#include "render/reference_picture.h"
#include "render/scenes.h"
#include "support/machine.h"
#include "support/stability.h"

namespace esvr::test {
namespace {

// Fields.

constexpr Box kBox{{0, 0, 0}, {199, 199, 199}};
const RevoxeliseOptions kVoxels{.threshold = 0.05f};

Field manyBlobs() { return randomField({.count = 2000, .extent = 200.0}); }

RenderOptions options(double degrees = 0.0) {
  RenderOptions o = pictureOf(kBox, {160, 120}, 20.0);
  o.camera = turned(o.camera, degrees);
  return o;
}

class CellsOnGpu : public OnGpu {
 protected:
  [[nodiscard]] std::unique_ptr<Renderer> renderer(const Field& field,
                                                   const RendererLimits& limits = {}) const {
    return makeFieldRenderer(field, device_, limits, kVoxels);
  }
};

TEST_F(CellsOnGpu, DrawTheDecodedVolume) {
  const Field field = manyBlobs();
  const SparseVolume volume = revoxelise(field, kVoxels);
  for (const double degrees : {0.0, 70.0, 145.0}) {
    const Image expected = renderVolume(volume, options(degrees));
    expectClose(renderer(field)->draw(options(degrees)), expected);
  }
}

/// A box that cuts through bricks.
constexpr Box kCut{{11, 0, 0}, {150, 187, 131}};

/// A camera among the blobs whose pixels grow from a part of a voxel to 30 voxels.
RenderOptions manyLevels() {
  RenderOptions o = options();
  o.resolution = {40, 30};
  o.camera = {.eye = {100, 100, -10}, .center = {90, 110, 100}, .up = {0, 1, 0}, .fov = 120.0};
  return o;
}

/// Levels are sums where all values are on one side of the background, and means otherwise.
TEST_F(CellsOnGpu, DrawTheLevelsOfFieldsAndVolumes) {
  for (const bool onOneSide : {true, false}) {
    Field field = manyBlobs();
    if (onOneSide)
      for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
    const SparseVolume volume = revoxelise(field, kVoxels);
    const auto drawn = renderer(field), ofVolume = makeVolumeRenderer(volume, device_);
    RenderOptions flat = options();
    flat.camera.projection = Projection::kOrthographic;
    for (const double height : {1600.0, 3200.0, 6400.0, 12800.0, 25600.0}) {
      flat.camera.height = height;
      expectClose(drawn->draw(flat), renderField(field, flat, kVoxels));
      expectClose(ofVolume->draw(flat), renderVolume(volume, flat));
    }
    expectClose(drawn->draw(manyLevels()), renderField(field, manyLevels(), kVoxels));
    expectClose(ofVolume->draw(manyLevels()), renderVolume(volume, manyLevels()));
  }
}

TEST_F(CellsOnGpu, DrawTheVoxelsOfMasksWithinABox) {
  const Field field = manyBlobs();
  const HalfMasks masked(field, kBox);
  const RevoxeliseOptions boxed{.threshold = 0.05f, .box = kCut};
  for (const RevoxeliseOptions& rule : {masked.within(kCut), boxed}) {
    const SparseVolume volume = revoxelise(field, rule);
    const auto drawn = makeFieldRenderer(field, device_, {}, rule);
    const Image image = drawn->draw(options(70.0));
    expectClose(image, renderVolume(volume, options(70.0)));
    expectClose(drawn->draw(manyLevels()), renderField(field, manyLevels(), rule));
    EXPECT_EQ(drawn->draw(options(70.0)).rgba, image.rgba);
    EXPECT_NE(image.rgba, renderer(field)->draw(options(70.0)).rgba);
  }
}

TEST_F(CellsOnGpu, DrawVoxelsThatAreAlwaysActive) {
  const Field field = manyBlobs();
  std::vector<Coord> always;
  for (std::int32_t n = 0; n < 30; ++n) always.push_back(kBox.min + Coord{n, 10 + n % 7, 8});
  const RevoxeliseOptions rule{.threshold = 0.5f, .alwaysActive = always};
  const SparseVolume volume = revoxelise(field, rule);
  const auto drawn = makeFieldRenderer(field, device_, {}, rule);
  expectClose(drawn->draw(options(70.0)), renderVolume(volume, options(70.0)));
  expectClose(drawn->draw(manyLevels()), renderField(field, manyLevels(), rule));
}

TEST_F(CellsOnGpu, DrawBricksOfWhichNoMaskHasAVoxel) {
  const Field field = manyBlobs();
  HalfMasks masked(field, kBox);
  masked.masks.assign(masked.bricks.size(), {});
  expectTransparent(makeFieldRenderer(field, device_, {}, masked.within(kCut))->draw(options()));
}

TEST_F(CellsOnGpu, AreShadedAsOnTheCpu) {
  const Field field = manyBlobs();
  const SparseVolume volume = revoxelise(field, kVoxels);
  RenderOptions shaded = options(30.0), levels = manyLevels();
  shaded.shading = levels.shading = Shading{};
  // A gradient near a flat spot turns with the rounding of its values.
  expectClose(renderer(field)->draw(shaded), renderVolume(volume, shaded), 200);
  expectClose(renderer(field)->draw(levels), renderField(field, levels, kVoxels), 200);
  expectClose(makeVolumeRenderer(volume, device_)->draw(shaded), renderVolume(volume, shaded), 200);
}

TEST_F(CellsOnGpu, AreMadeAndDrawnOnSeveralThreads) {
  const Field field = manyBlobs();
  const Image expected = renderer(field)->draw(options());
  std::atomic<int> equal = 0;
  std::vector<std::thread> threads;
  for (int n = 0; n < 4; ++n)
    threads.emplace_back([&] { equal += renderer(field)->draw(options()).rgba == expected.rgba; });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(equal, 4);
}

TEST_F(CellsOnGpu, DrawManyEllipsoidsInOneBrickSlow) {
  const Field field = randomField({.count = 10'000'000, .extent = 8.0, .smallest = 0.3});
  RenderOptions o = pictureOf({{0, 0, 0}, {7, 7, 7}}, {24, 18}, 20.0);
  o.transfer = rescaled(o.transfer, {-1000.0f, 1000.0f});
  expectClose(makeFieldRenderer(field, device_, {}, {})->draw(o),
              renderVolume(revoxelise(field, {}), o), 100);
}

TEST_F(CellsOnGpu, HaveTheSameBitsOfAllLevels) {
  const Field field = manyBlobs();
  const auto drawn = renderer(field);
  const Image fresh = drawn->draw(manyLevels());
  (void)drawn->draw(options());
  EXPECT_EQ(drawn->draw(manyLevels()).rgba, fresh.rgba);
  drawn->forget();
  EXPECT_EQ(drawn->draw(manyLevels()).rgba, fresh.rgba);
}

TEST_F(CellsOnGpu, HaveTheSameBitsWhateverWasDecodedBefore) {
  const Field field = manyBlobs();
  const Image fresh = renderer(field)->draw(options(70.0));
  const auto other = renderer(field);
  for (const double degrees : {0.0, 35.0, 140.0}) (void)other->draw(options(degrees));
  EXPECT_EQ(other->draw(options(70.0)).rgba, fresh.rgba);
  EXPECT_EQ(other->draw(options(70.0)).rgba, fresh.rgba);
}

TEST_F(CellsOnGpu, HaveTheSameBitsInMemoryForAPartOfTheBricks) {
  const Field field = manyBlobs();
  const auto unlimited = renderer(field);
  const Image expected = unlimited->draw(options());
  const std::uint64_t needed = unlimited->stats().deviceBytes;
  for (const std::uint64_t less : {1u << 20, 4u << 20, 8u << 20}) {
    const auto limited = renderer(field, {.maxBytes = needed - less});
    EXPECT_EQ(limited->draw(options()).rgba, expected.rgba) << less;
    EXPECT_EQ(limited->draw(options()).rgba, expected.rgba) << less;
    EXPECT_LE(limited->stats().deviceBytes, needed - less);
  }
}

TEST_F(CellsOnGpu, TakeMemoryForWhatIsSeen) {
  const Field field = manyBlobs();
  const auto whole = renderer(field), part = renderer(field);
  RenderOptions clipped = options();
  clipped.clip = PlaceBox{{0, 0, 0}, {40, 40, 40}};
  (void)whole->draw(options());
  (void)part->draw(clipped);
  EXPECT_LT(part->stats().deviceBytes, whole->stats().deviceBytes);
}

TEST_F(CellsOnGpu, DrawNothingForAFieldOfNothing) {
  expectTransparent(renderer(Field{})->draw(options()));
}

TEST_F(CellsOnGpu, RefuseALimitThatIsTooSmall) {
  const Field field = manyBlobs();
  EXPECT_THROW((void)renderer(field, {.maxBytes = 1000})->draw(options()), DeviceError);
}

// Volumes.

SparseVolume blobs() {
  return revoxelise(randomField({.count = 60, .extent = 90.0, .origin = {-16, 8, 0}}),
                    {.threshold = 0.05f});
}

RenderOptions optionsOfVolume(const CameraWish& wish = {}) {
  return pictureOf({{-16, 8, 0}, {73, 97, 89}}, {131, 78}, 8.0, wish);
}

class BricksOnGpu : public OnGpu {
 protected:
  void expectTheCpusPicture(const RenderOptions& o, const RendererLimits& limits = {}) const {
    const SparseVolume volume = blobs();
    EXPECT_LE(largestDifference(makeVolumeRenderer(volume, device_, limits)->draw(o),
                                renderVolume(volume, o)),
              1.0 / 255.0);
  }
};

TEST_F(BricksOnGpu, AgreeFromEveryKindOfCamera) {
  expectTheCpusPicture(optionsOfVolume());
  expectTheCpusPicture(optionsOfVolume(orthographic()));
  expectTheCpusPicture(
      optionsOfVolume({.eye = Vec3{19.3, 51.7, 48.1}, .center = Vec3{0, 80, 3}, .fov = 80.0}));
  expectTheCpusPicture(optionsOfVolume(farAway({29, 53, 45}, 60.0)));
}

TEST_F(BricksOnGpu, AgreeForOtherStepsAndClipped) {
  for (const double step : {0.3, 4.0}) {
    RenderOptions o = optionsOfVolume();
    o.step = step;
    expectTheCpusPicture(o);
  }
  RenderOptions o = optionsOfVolume();
  o.classification = Classification::kPost;
  expectTheCpusPicture(o);
  o.classification = Classification::kPreIntegrated;
  o.clip = PlaceBox{{-5, 20, 10.5}, {40, 70, 60.5}};
  expectTheCpusPicture(o);
}

TEST_F(BricksOnGpu, DrawInBandsWhereMemoryIsShort) {
  const SparseVolume volume = blobs();
  const auto whole = makeVolumeRenderer(volume, device_);
  (void)whole->draw(optionsOfVolume());
  expectTheCpusPicture(optionsOfVolume(), {.maxBytes = whole->stats().deviceBytes - 100'000});
  EXPECT_THROW(
      (void)makeVolumeRenderer(volume, device_, {.maxBytes = 1000})->draw(optionsOfVolume()),
      DeviceError);
}

// Given bricks.

class DeviceBricks : public OnDevice {};

TEST_P(DeviceBricks, StayWithinTheBoundOfTheirArithmetic) {
  for (const RandomFieldOptions& shape : std::initializer_list<RandomFieldOptions>{
           {},
           {.smallest = 0.1, .aspect = 1000.0},
           {.kappa = -30.0f},
           {.kappa = 30.0f},
           {.count = 5000, .extent = 8.0, .smallest = 0.3},
           {.intensity = 1e-30},
           {.intensity = 1e30},
           {.origin = {10'000'000, -10'000'000, 10'000'000}}}) {
    const Stability s = measureStability(randomField(shape), {.device = device_});
    EXPECT_GT(s.largest, 0.0) << "no rounding at all proves nothing";
    EXPECT_LT(s.shareOfBound, 1.0) << "kappa " << shape.kappa << ", aspect " << shape.aspect;
  }
}

TEST_P(DeviceBricks, HoldTheBackgroundWhereNothingReaches) {
  Field field = randomField({.count = 3});
  field.background = 0.25f;
  const std::vector<Coord> corners{{-800, 0, 0}, {0, 0, 0}, {800, 0, 0}};
  std::vector<float> values(corners.size() * kBrickVoxels);
  evaluateBricksOn(device_, field, corners, values);
  const std::span all(values);
  EXPECT_THAT(all.first(kBrickVoxels), testing::Each(0.25f));
  EXPECT_THAT(all.last(kBrickVoxels), testing::Each(0.25f));
}

TEST_P(DeviceBricks, AreTheSameInAnyCompany) {
  const Field field = randomField({.count = 2000, .extent = 100.0});
  const auto corners = reachedBricks(field);
  ASSERT_GT(corners.size(), 600u) << "the bricks of several batches";
  std::vector<float> all(corners.size() * kBrickVoxels), one(kBrickVoxels);
  evaluateBricksOn(device_, field, corners, all);
  const std::size_t chosen = corners.size() / 2;
  evaluateBricksOn(device_, field, std::span(corners).subspan(chosen, 1), one);
  EXPECT_THAT(
      one, testing::ElementsAreArray(std::span(all).subspan(chosen * kBrickVoxels, kBrickVoxels)));
}

ESVR_ON_DEVICES(DeviceBricks);

// ---- Several grids

class GridsOnGpu : public OnGpu {
 protected:
  [[nodiscard]] std::unique_ptr<Renderer> renderer(const std::vector<DrawnGrid>& grids,
                                                   const RendererLimits& limits = {}) const {
    return makeGridsRenderer(grids, device_, limits);
  }

  const Field first_ = firstField(), second_ = secondField();
  const SparseVolume firstVolume_ = revoxelise(first_, kVoxelsOfGrids);
  const SparseVolume secondVolume_ = revoxelise(second_, kVoxelsOfGrids);
  const std::vector<DrawnGrid> fields_{DrawnField{&first_, kVoxelsOfGrids},
                                       DrawnField{&second_, kVoxelsOfGrids}};
  const std::vector<DrawnGrid> volumes_{&firstVolume_, &secondVolume_};
  const std::vector<DrawnGrid> mixed_{fields_[0], volumes_[1]};
};

TEST_F(GridsOnGpu, AgreeWithTheCpu) {
  for (const auto& grids : {fields_, volumes_, mixed_})
    for (const bool absorbs : {true, false})
      for (const auto classification : {Classification::kPreIntegrated, Classification::kPost}) {
        RenderOptions o = optionsForTwo(absorbs ? 20.0 : 110.0);
        o.further[0].absorbs = absorbs;
        o.classification = classification;
        expectClose(renderer(grids)->draw(o), makeGridsRenderer(volumes_, Device{})->draw(o));
      }
}

TEST_F(GridsOnGpu, AgreeForOneToFourGrids) {
  RenderOptions o = optionsForTwo();
  o.opacityLength = 60.0;
  o.further.clear();
  std::vector<DrawnGrid> grids, volumes;
  for (int n = 0; n < kMostGrids; ++n) {
    if (n > 0) o.further.push_back({o.transfer, n % 2 == 0});
    grids.push_back(fields_[std::size_t(n % 2)]);
    volumes.push_back(volumes_[std::size_t(n % 2)]);
    expectClose(renderer(grids)->draw(o), makeGridsRenderer(volumes, Device{})->draw(o));
  }
}

TEST_F(GridsOnGpu, HaveTheSameBitsWhateverWasDecodedBefore) {
  const Image fresh = renderer(fields_)->draw(optionsForTwo(70.0));
  const auto other = renderer(fields_);
  for (const double degrees : {0.0, 35.0, 140.0}) (void)other->draw(optionsForTwo(degrees));
  EXPECT_EQ(other->draw(optionsForTwo(70.0)).rgba, fresh.rgba);
  other->forget();
  EXPECT_EQ(other->draw(optionsForTwo(70.0)).rgba, fresh.rgba);
}

/// Each grid keeps a page of 256 bricks at least.
TEST_F(GridsOnGpu, HaveTheSameBitsInMemoryForAPartOfTheBricks) {
  for (const auto& grids : {fields_, mixed_}) {
    const auto unlimited = renderer(grids);
    RenderOptions o = optionsForTwo();
    o.resolution = {160, 120};
    const Image expected = unlimited->draw(o);
    const std::uint64_t needed = unlimited->stats().deviceBytes;
    for (const std::uint64_t less : {300'000u, 700'000u, 1'400'000u}) {
      const auto limited = renderer(grids, {.maxBytes = needed - less});
      EXPECT_EQ(limited->draw(o).rgba, expected.rgba) << less;
      EXPECT_EQ(limited->draw(o).rgba, expected.rgba) << less;
      EXPECT_LE(limited->stats().deviceBytes, needed - less);
    }
  }
}

TEST_F(GridsOnGpu, AreDrawnWhereOneOrAllAreEmpty) {
  const Field nothing;
  const RenderOptions o = optionsForTwo();
  RenderOptions alone = o;
  alone.further.clear();
  EXPECT_EQ(renderer({fields_[0], DrawnField{&nothing, {}}})->draw(o).rgba,
            renderer({fields_[0]})->draw(alone).rgba);
  expectTransparent(renderer({DrawnField{&nothing, {}}, DrawnField{&nothing, {}}})->draw(o));
}

TEST_F(GridsOnGpu, RefuseWhatTheyDoNotHave) {
  RenderOptions o = optionsForTwo();
  o.mode = RenderMode::kAverage;
  EXPECT_THROW((void)renderer(fields_)->draw(o), UsageError);
  o = optionsForTwo(), o.further.clear();
  EXPECT_THROW((void)renderer(fields_)->draw(o), UsageError);
  EXPECT_THROW((void)renderer(fields_, {.maxBytes = 1000})->draw(optionsForTwo()), DeviceError);
}

// ---- NanoVDB

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

// ---- Memory

/// Takes all memory of the device but for some bytes.
class TakenMemory {
 public:
  explicit TakenMemory(std::size_t left) {
    std::size_t free = 0, all = 0;
    EXPECT_EQ(cudaMemGetInfo(&free, &all), cudaSuccess);
    EXPECT_EQ(cudaMalloc(&memory_, free - left), cudaSuccess);
  }
  TakenMemory(const TakenMemory&) = delete;
  TakenMemory& operator=(const TakenMemory&) = delete;
  ~TakenMemory() { cudaFree(memory_); }

 private:
  void* memory_ = nullptr;
};

using MemoryOnGpu = OnGpu;

TEST_F(MemoryOnGpu, IsSaidToBeExhaustedAndIsUsedAgain) {
  const Field field = randomField({.count = 2000, .extent = 200.0});
  const RenderOptions small = pictureOf({{0, 0, 0}, {199, 199, 199}}, {160, 120}, 1.0);
  RenderOptions large = small;
  large.resolution = {4000, 3000};  // 192 MB of pixels
  const auto renderer = makeFieldRenderer(field, device_);
  const Image expected = renderer->draw(small);
  {
    const TakenMemory taken(std::size_t(64) << 20);
    EXPECT_THROW((void)renderer->draw(large), DeviceError);
    EXPECT_EQ(renderer->draw(small).rgba, expected.rgba);
  }
  EXPECT_EQ(renderer->draw(large).width, 4000);
}

using cuda::kNoOwner;
using cuda::oldestSlots;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

const std::vector<std::uint32_t> kOwners{10, 11, kNoOwner, 12}, kStamps{5, 2, 0, 9};

TEST(OldestSlots, AreThoseThatWereNotReadForTheLongestTime) {
  EXPECT_THAT(oldestSlots(1, kOwners, kStamps), UnorderedElementsAre(1u));
  EXPECT_THAT(oldestSlots(2, kOwners, kStamps), UnorderedElementsAre(0u, 1u));
}

TEST(OldestSlots, AreNoMoreThanThereAre) {
  EXPECT_THAT(oldestSlots(9, kOwners, kStamps), UnorderedElementsAre(0u, 1u, 3u));
  EXPECT_THAT(oldestSlots(3, {}, {}), IsEmpty());
}

}  // namespace

}  // namespace esvr::test
