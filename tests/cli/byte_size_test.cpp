// Plan: sizes as users write them are parsed, and other texts are refused.

#include "cli/byte_size.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/error.h"

namespace esvr::cli {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

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

}  // namespace
}  // namespace esvr::cli
