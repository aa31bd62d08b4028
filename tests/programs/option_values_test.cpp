// Plan: sizes as users write them are parsed, and other texts are refused. Bounds may be given in
// value units and as a share of the range; other texts are refused.

#include "programs/option_values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/error.h"

namespace esvr::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(NumberList, ReadsAsManyNumbersAsAskedFor) {
  EXPECT_THAT(parseNumbers("eye", "1,-2.5,3e2", 3), ElementsAre(1.0, -2.5, 300.0));
  EXPECT_THAT(parseNumbers("range", "0,1", 2), ElementsAre(0.0, 1.0));
}

TEST(NumberList, RefusesAnythingElseAndNamesTheOption) {
  for (const char* text : {"", "1", "1,2", "1,2,3,4", "1,2,x", "1 2 3", "1,,3", "1,2,nan",
                           "1,2,inf", "1,2,1e999", "1,2,3 "})
    EXPECT_THROW((void)parseNumbers("eye", text, 3), UsageError) << text;
  try {
    (void)parseNumbers("eye", "1", 3);
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("--eye must be 3 numbers"));
  }
}

TEST(ByteSize, knowsUnits) {
  EXPECT_EQ(parseByteSize("size", "50000"), 50'000u);
  EXPECT_EQ(parseByteSize("size", "50KB"), 50'000u);
  EXPECT_EQ(parseByteSize("size", "2.6MB"), 2'600'000u);
  EXPECT_EQ(parseByteSize("size", "48kib"), 49'152u);
  EXPECT_EQ(parseByteSize("size", "1GiB"), std::uint64_t{1} << 30);
  EXPECT_EQ(parseByteSize("size", "7b"), 7u);
}

TEST(ByteSize, refusesTextThatIsNoSize) {
  for (const char* text : {"", "KB", "-5KB", "0", "0.4", "5 KB", "5XB", "1e300", "nan", "inf"})
    EXPECT_THAT([&] { (void)parseByteSize("size", text); },
                ThrowsMessage<UsageError>(HasSubstr("--size must be a size")))
        << text;
}

TEST(DeviceMemory, hasTheUnitsOfOtherSizes) {
  EXPECT_EQ(parseDeviceMemory("max-vram", "64MB"), 64'000'000u);
  EXPECT_EQ(parseDeviceMemory("max-vram", "1.5GiB"), std::uint64_t{3} << 29);
  EXPECT_EQ(parseDeviceMemory("max-vram", "64000000"), 64'000'000u);
}

TEST(DeviceMemory, isOfGigabytesWithoutAUnitIfThatIsTheOnlyMeaning) {
  EXPECT_EQ(parseDeviceMemory("max-vram", "4"), 4'000'000'000u);
  EXPECT_EQ(parseDeviceMemory("max-vram", "0.003"), 3'000'000u);
  EXPECT_EQ(parseDeviceMemory("max-vram", "1000000"), 1'000'000u);
}

TEST(DeviceMemory, refusesWhatIsNoMemoryOrTooLittle) {
  for (const char* text : {"", "x", "-4", "0", "4XB", "nan", "1e300"})
    EXPECT_THAT([&] { (void)parseDeviceMemory("max-vram", text); },
                ThrowsMessage<UsageError>(HasSubstr("--max-vram must be a size")))
        << text;
  for (const char* text : {"999KB", "0.0001"})
    EXPECT_THAT([&] { (void)parseDeviceMemory("max-vram", text); },
                ThrowsMessage<UsageError>(HasSubstr("at least 1MB")))
        << text;
}

TEST(ErrorBound, isInUnitsOrAShareOfTheRange) {
  EXPECT_EQ(parseErrorBound("max-error", "0.25").absolute(8.0), 0.25);
  EXPECT_EQ(parseErrorBound("max-error", "25%").absolute(8.0), 2.0);
}

TEST(ErrorBound, isAFiniteNumberAboveZero) {
  for (const char* text : {"", "%", "0", "-1", "much", "1x", "1%%", "inf", "nan"})
    EXPECT_THROW((void)parseErrorBound("max-error", text), UsageError) << text;
}

}  // namespace
}  // namespace esvr::cli
