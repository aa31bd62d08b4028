// Plan: files of a stack are found by a folder, a pattern or their names, in the order of their
// numbers, and a stack with a gap is refused.

#include "images/image_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/run_program.h"
#include "esvr/error.h"

namespace esvr::samples {
namespace {

using test::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

void touch(const TemporaryFolder& folder, const std::vector<std::string>& names) {
  for (const auto& name : names) test::writeText(folder / name, "");
}

std::vector<std::string> namesOf(const ImageFiles& files) {
  std::vector<std::string> names;
  for (const auto& path : files.paths) names.push_back(path.filename().string());
  return names;
}

TEST(IsBefore, comparesNumbersByTheirValues) {
  EXPECT_TRUE(isBefore("a2.tif", "a10.tif"));
  EXPECT_TRUE(isBefore("a010.tif", "a11.tif"));
  EXPECT_TRUE(isBefore("a", "a1"));
  EXPECT_TRUE(isBefore("2/a99", "10/a1"));
  EXPECT_TRUE(isBefore("a99999999999999999998", "a99999999999999999999"));
  EXPECT_TRUE(isBefore("a01", "a1"));
  EXPECT_FALSE(isBefore("a1", "a01"));
  EXPECT_FALSE(isBefore("a1", "a1"));
  EXPECT_FALSE(isBefore("b1", "a2"));
}

TEST(ImageFiles, ofAFolderAreItsTiffFilesInTheOrderOfTheirNumbers) {
  const TemporaryFolder folder;
  touch(folder, {"s10.tif", "s9.TIFF", "s1.tif", "notes.txt"});
  EXPECT_THAT(namesOf(imageFiles({folder.path().string()})),
              ElementsAre("s1.tif", "s9.TIFF", "s10.tif"));
}

TEST(ImageFiles, ofAPatternAreInTheOrderOfTheirNumbers) {
  const TemporaryFolder folder;
  touch(folder, {"s8.tif", "s10.tif", "s9.tif", "s011.tif"});
  EXPECT_THAT(namesOf(imageFiles({folder / "s@.tif"})), ElementsAre("s8.tif", "s9.tif", "s10.tif"));
}

TEST(ImageFiles, mayHaveNumbersInEvenSteps) {
  const TemporaryFolder folder;
  touch(folder, {"s00.tif", "s05.tif", "s10.tif"});
  EXPECT_THAT(namesOf(imageFiles({folder / "s##.tif"})),
              ElementsAre("s00.tif", "s05.tif", "s10.tif"));
}

TEST(ImageFiles, withAGapAreRefused) {
  const TemporaryFolder folder;
  touch(folder, {"s1.tif", "s3.tif", "s4.tif"});
  EXPECT_THAT([&] { (void)imageFiles({folder / "s@.tif"}); },
              ThrowsMessage<BadInput>(HasSubstr("slice 2 is missing")));
}

TEST(ImageFiles, thatDoNotExistAreNamed) {
  const TemporaryFolder folder;
  touch(folder, {"s001.tif", "notes.txt"});
  EXPECT_THAT([&] { (void)imageFiles({folder / "s##.tif"}); },
              ThrowsMessage<BadInput>(testing::AllOf(HasSubstr("s##.tif"), HasSubstr("s001.tif"))));
  const TemporaryFolder empty;
  EXPECT_THAT([&] { (void)imageFiles({empty.path().string()}); },
              ThrowsMessage<BadInput>(HasSubstr("has no TIFF file")));
}

TEST(ImageFiles, withAPatternInItsNameIsOneFileIfItExists) {
  const TemporaryFolder folder;
  touch(folder, {"s##.tif", "s01.tif"});
  EXPECT_THAT(namesOf(imageFiles({folder / "s##.tif"})), ElementsAre("s##.tif"));
}

TEST(ImageFiles, keepTheOrderInWhichTheyAreNamed) {
  const auto files = imageFiles({"s1.tif", "s10.tif", "s2.tif"});
  EXPECT_THAT(namesOf(files), ElementsAre("s1.tif", "s10.tif", "s2.tif"));
  EXPECT_TRUE(files.outOfOrder);
  EXPECT_FALSE(imageFiles({"s1.tif", "s2.tif", "s10.tif"}).outOfOrder);
}

}  // namespace
}  // namespace esvr::samples
