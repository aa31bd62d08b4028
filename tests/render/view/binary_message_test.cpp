// Plan: the bytes of a message are compared with bytes written by hand.

#include "render/view/binary_message.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace esvr::view {
namespace {

using namespace std::string_literals;

TEST(BinaryMessage, HasItsHeadBetweenTheLengthAndTheBytes) {
  EXPECT_EQ(binaryMessage({{"id", 1}}, "\0xyz"s), "\x08\0\0\0{\"id\":1}\0xyz"s);
}

TEST(BinaryMessage, HasALengthOfSeveralBytes) {
  const std::string message = binaryMessage({{"x", std::string(0x12345, 'x')}}, "");
  EXPECT_EQ(message.substr(0, 4), "\x4d\x23\x01\0"s);  // 0x12345 and the 8 bytes {"x":""}
}

TEST(JsonText, ReplacesBytesThatAreNotUtf8) {
  EXPECT_EQ(textOf({{"name", "a\xff"}}), "{\"name\":\"a\xef\xbf\xbd\"}");
}

}  // namespace
}  // namespace esvr::view
