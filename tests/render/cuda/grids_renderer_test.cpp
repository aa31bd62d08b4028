// Plan: pictures of several grids on a GPU agree with those on the CPU to within 1/255, for fields,
// volumes and both together, and have the same bits whatever was decoded before and however little
// memory there is for bricks.
#include <gtest/gtest.h>

#include "esvr/error.h"
#include "esvr/field.h"
#include "render/reference_picture.h"
#include "render/scenes.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

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

}  // namespace
}  // namespace esvr::test
