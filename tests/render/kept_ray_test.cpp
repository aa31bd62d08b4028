// Plan: rays march through bricks that are there only once a ray has asked for them. Whenever a ray
// waits, its state is replaced by what is kept of it. Its color must have the bits of a march through
// bricks that are all there, in all modes, with gaps between the bricks, and for several grids.
#include <gtest/gtest.h>

#include "render/brick_atlas.h"
#include "render/brick_scene.h"
#include "render/kept_ray.h"
#include "render/level_of_detail.h"
#include "render/picture.h"

namespace esvr::test {
namespace {

/// Bricks that are there after a ray has asked for them.
struct AppearingSlots {
  std::vector<std::uint32_t> slotOf;
  BrickSlotsView all;

  [[nodiscard]] std::uint32_t slot(std::uint32_t brick) const { return slotOf[brick]; }
  [[nodiscard]] static bool hasSlot(std::uint32_t slot) { return BrickSlotsView::hasSlot(slot); }
  [[nodiscard]] const float* values(std::uint32_t slot) const { return all.values(slot); }
};

/// Brings the brick at which a ray waits.
struct Bringing {
  std::vector<AppearingSlots>& slots;

  void entered(std::uint32_t) const {}
  void entered(int, std::uint32_t) const {}
  [[nodiscard]] bool wantsMore(std::uint32_t brick, std::uint32_t) const {
    return wantsMore(0, brick, 0);
  }
  [[nodiscard]] bool wantsMore(int grid, std::uint32_t brick, std::uint32_t) const {
    slots[std::size_t(grid)].slotOf[brick] = brick;
    return false;
  }
};

/// A volume with bricks side by side and with gaps between them, on one diagonal.
struct Scene {
  explicit Scene(std::uint64_t seed)
      : volume(randomBricks({{0, 0, 0}, {0, 0, 8}, {8, 8, 8}, {8, 8, 16}, {24, 24, 24}}, seed)),
        atlas(makeBrickAtlas(volume)),
        pages(atlas.pages()) {}

  [[nodiscard]] BrickSlotsView all() const { return {nullptr, pages.data()}; }
  [[nodiscard]] AppearingSlots none() const {
    return {std::vector(atlas.table.bricks.size(), BrickSlotsView::kMissing), all()};
  }
  [[nodiscard]] MarchScene march(const RenderOptions& o, const TransferTableView& table) const {
    MarchScene scene = sceneOfLevel(
        marchScene(o, View(o.camera, o.resolution), sampleRule(o, table, volume.background)),
        LevelFrame{0}, atlas.table.origin);
    scene.box = cellsOf(atlas.table);
    return scene;
  }

  SparseVolume volume;
  BrickAtlas atlas;
  std::vector<const float*> pages;
};

constexpr SampleRange kAll{0.0, 1e9};

bool equal(const PixelColor& a, const PixelColor& b) {
  return a.r == b.r && a.g == b.g && a.b == b.b && a.alpha == b.alpha;
}

/// Compares all pixels of a picture. \return how often rays waited
int compareRays(const RenderOptions& o) {
  const Scene scene(5);
  const TransferTable table(o.transfer, samplingOf(o));
  const MarchScene march = scene.march(o, table.view());
  int waited = 0;
  for (int row = 0; row < o.resolution.height; ++row)
    for (int column = 0; column < o.resolution.width; ++column) {
      const MarchSamples samples = samplesOf(march, column, row, kAll);
      RayProgress whole, ray;
      AllBricksAreThere there;
      EXPECT_TRUE(marchBricks(scene.atlas.table.view(), scene.all(), march, samples, whole, there));
      std::vector<AppearingSlots> slots{scene.none()};
      Bringing bringing{slots};
      while (!marchBricks(scene.atlas.table.view(), slots[0], march, samples, ray, bringing)) {
        ray = KeptRay::of(ray).progress(channelsOf(ray));
        ++waited;
      }
      EXPECT_TRUE(equal(march.rule.finished(ray.ray), march.rule.finished(whole.ray)));
    }
  return waited;
}

TEST(KeptRay, GoesOnAsIfItHadNotWaited) {
  RenderOptions o = optionsFor(Scene(5).volume);
  for (const RenderMode mode :
       {RenderMode::kComposite, RenderMode::kMaximum, RenderMode::kAverage, RenderMode::kDepth})
    for (const Classification c : {Classification::kPreIntegrated, Classification::kPost})
      for (const double minTransmittance : {0.0, 0.5}) {
        o.mode = mode, o.classification = c, o.minTransmittance = minTransmittance;
        EXPECT_GT(compareRays(o), 100);
      }
}

TEST(KeptRay, HasEnded) {
  EXPECT_LT(KeptRay::ended().next, 0);
  EXPECT_LT(KeptGridsRay::ended().next, 0);
}

TEST(KeptGridsRay, GoesOnAsIfItHadNotWaited) {
  const Scene first(5), second(6);
  RenderOptions o = optionsFor(first.volume);
  const TransferTable table(o.transfer, samplingOf(o));
  GridsScene scene{first.march(o, table.view()), {}};
  const GridInScene grid{first.atlas.table.view(), table.view(), 0.0f, true, {0, 0, 0}};
  scene.grids[0] = scene.grids[1] = grid;
  scene.grids[1].absorbs = false;
  const BrickSlotsView all[] = {first.all(), second.all()};
  int waited = 0;
  for (int row = 0; row < o.resolution.height; ++row)
    for (int column = 0; column < o.resolution.width; ++column) {
      const MarchSamples samples = samplesOf(scene.scene, column, row, kAll);
      GridsProgress whole, ray;
      AllGridsAreThere there;
      EXPECT_TRUE(marchGrids<2>(scene, all, samples, whole, there));
      std::vector<AppearingSlots> slots{first.none(), second.none()};
      Bringing bringing{slots};
      while (!marchGrids<2>(scene, slots.data(), samples, ray, bringing)) {
        ray = KeptGridsRay::of(ray).progress(channelsOf(ray));
        ++waited;
      }
      EXPECT_TRUE(equal(finished<2>(scene, ray), finished<2>(scene, whole)));
    }
  EXPECT_GT(waited, 100);
}

}  // namespace
}  // namespace esvr::test
