// Plan: numbers of 16-bit floats become the floats of IEEE 754; steps between numbers are skipped.
// The other types are tested with each format.

#include "images/element_type.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "samples/whole_image.h"

namespace esvr::samples {
namespace {

float halfOf(std::uint16_t bits) {
  const std::string bytes = bytesOf(bits);
  float value = 0.0f;
  elementType("float16").decode({.bytes = std::as_bytes(std::span(bytes))}, {&value, 1});
  return value;
}

TEST(ElementType, readsHalfFloats) {
  EXPECT_EQ(halfOf(0x0000), 0.0f);
  EXPECT_TRUE(std::signbit(halfOf(0x8000)));
  EXPECT_EQ(halfOf(0x3c00), 1.0f);
  EXPECT_EQ(halfOf(0xc000), -2.0f);
  EXPECT_EQ(halfOf(0x3555), 0.333251953125f);
  EXPECT_EQ(halfOf(0x7bff), 65504.0f) << "the largest";
  EXPECT_EQ(halfOf(0x0400), 0x1p-14f) << "the smallest with a leading bit";
  EXPECT_EQ(halfOf(0x0001), 0x1p-24f) << "the smallest";
  EXPECT_EQ(halfOf(0xfc00), -INFINITY);
  EXPECT_TRUE(std::isnan(halfOf(0x7e00)));
}

TEST(ElementType, takesOneOfSeveralComponents) {
  const std::string bytes = bytesOf(std::vector<std::int16_t>{1, -2, 3, 4, -5, 6}, true);
  std::vector<float> values(2);
  elementType("int16").decode(
      {.bytes = std::as_bytes(std::span(bytes)), .bigEndian = true, .first = 1, .step = 3}, values);
  EXPECT_THAT(values, testing::ElementsAre(-2.0f, -5.0f));
}

}  // namespace
}  // namespace esvr::samples
