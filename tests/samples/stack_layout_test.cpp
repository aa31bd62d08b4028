// Plan: the texts of ImageJ and OME give channels, slices and edges of voxels; a text that does not
// fit the pages is refused.

#include "images/stack_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/error.h"

namespace esvr::samples {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(StackLayout, withoutATextTakesEachPageAsASlice) {
  const auto layout =
      stackLayout({.path = "a.tif", .text = "a cell", .pages = 3, .resolution = {72, 72}});
  EXPECT_EQ(layout.slices, 3u);
  EXPECT_EQ(layout.channels, 1u);
  EXPECT_THAT(layout.voxelSize, ElementsAre(1.0, 1.0, 1.0)) << "dots per inch say nothing of z";
  EXPECT_THAT(pagesOf(layout, 0), ElementsAre(0u, 1u, 2u));
}

TEST(StackLayout, takesChannelsAndSpacingFromImageJ) {
  const auto layout =
      stackLayout({.path = "a.tif",
                   .text = "ImageJ=1.53t\nimages=6\nchannels=2\nslices=3\nhyperstack=true\n"
                           "unit=micron\nspacing=2.5\nloop=false\n",
                   .pages = 6,
                   .resolution = {4.0, 2.0}});
  EXPECT_EQ(layout.slices, 3u);
  EXPECT_THAT(layout.voxelSize, ElementsAre(0.25, 0.5, 2.5));
  EXPECT_THAT(pagesOf(layout, 0), ElementsAre(0u, 2u, 4u));
  EXPECT_THAT(pagesOf(layout, 1), ElementsAre(1u, 3u, 5u));
}

TEST(StackLayout, takesTheSlicesThatImageJCallsImagesOrFrames) {
  EXPECT_EQ(stackLayout({"a.tif", "ImageJ=1.53t\nimages=4\n", 4}).slices, 4u);
  EXPECT_EQ(stackLayout({"a.tif", "ImageJ=1.53t\nimages=4\nframes=4\n", 4}).slices, 4u);
}

std::string ome(const std::string& pixels, const std::string& channel = "") {
  return "<?xml version=\"1.0\"?><OME><Image><Pixels ID=\"P\" " + pixels + "><Channel ID=\"C\" " +
         channel + "/></Pixels></Image></OME>";
}

TEST(StackLayout, takesTheOrderOfPagesAndSpacingFromOme) {
  const auto layout = stackLayout(
      {"a.tif",
       ome("DimensionOrder=\"XYZCT\" SizeC=\"2\" SizeZ=\"3\" SizeT=\"1\" PhysicalSizeX=\"0.1\" "
           "PhysicalSizeY=\"0.2\" PhysicalSizeZ=\"1e-1\""),
       6});
  EXPECT_THAT(layout.voxelSize, ElementsAre(0.1, 0.2, 0.1));
  EXPECT_THAT(pagesOf(layout, 1), ElementsAre(3u, 4u, 5u));
  EXPECT_THAT(
      pagesOf(stackLayout({"a.tif", ome("DimensionOrder=\"XYCZT\" SizeC=\"2\" SizeZ=\"2\""), 4}),
              1),
      ElementsAre(1u, 3u));
}

TEST(StackLayout, doesNotCountTheColorsOfOneOmePageAsPages) {
  EXPECT_EQ(
      stackLayout({"a.tif", ome("SizeC=\"3\" SizeZ=\"2\"", "SamplesPerPixel=\"3\""), 2}).channels,
      1u);
}

TEST(StackLayout, refusesATextOfOtherPagesOrOfSeveralTimes) {
  EXPECT_THAT(
      [] {
        (void)stackLayout({"a.tif", "ImageJ=1.53t\nimages=4\nslices=4\n", 3});
      },
      ThrowsMessage<BadInput>(
          testing::AllOf(HasSubstr("a.tif has 3 pages"), HasSubstr("4 slices"))));
  EXPECT_THAT(
      [] {
        (void)stackLayout({"a.tif", "ImageJ=1\nimages=4\nslices=2\nframes=2\n", 4});
      },
      ThrowsMessage<BadInput>(HasSubstr("changes over time")));
}

TEST(StackLayout, survivesTextsThatAreCutOrAbsurd) {
  for (const std::string text :
       {"ImageJ=", "ImageJ=1\nimages=-4\nchannels=99999999999999999999\nslices=x\nspacing=-1\n",
        "<OME", "<OME><Pixels SizeC=\"", "<OME><Pixels SizeC=\"0\" PhysicalSizeX=\"nan\">"})
    EXPECT_THAT(stackLayout({"a.tif", text, 1}).voxelSize, ElementsAre(1.0, 1.0, 1.0)) << text;
}

TEST(ImageJPages, isWhatTheTextNames) {
  EXPECT_EQ(imageJPages("ImageJ=1.53t\nimages=4000\n"), 4000u);
  EXPECT_EQ(imageJPages("ImageJ=1.53t\n"), 1u);
  EXPECT_FALSE(imageJPages("images=4\n"));
}

}  // namespace
}  // namespace esvr::samples
