// Plan: tokens have the length and the digits of 128 bits and do not repeat; texts are compared with
// texts that differ in one place.

#include "render/view/token.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace esvr::view {
namespace {

TEST(Token, Has128RandomBits) {
  constexpr std::size_t kTokens = 100;
  std::set<std::string> tokens;
  std::set<char> digits;
  while (tokens.size() < kTokens) {
    const std::string token = randomToken();
    EXPECT_THAT(token, testing::MatchesRegex("[0-9a-f]{32}"));
    digits.insert(token.begin(), token.end());
    ASSERT_TRUE(tokens.insert(token).second);
  }
  EXPECT_EQ(digits.size(), 16u);
}

TEST(Token, IsComparedInAllItsPlaces) {
  const std::string token = randomToken();
  EXPECT_TRUE(sameSecret(token, token));
  for (std::size_t i = 0; i < token.size(); ++i) {
    std::string other = token;
    other[i] = char(other[i] ^ 1);
    EXPECT_FALSE(sameSecret(token, other)) << i;
  }
  EXPECT_FALSE(sameSecret(token, token.substr(1)));
  EXPECT_FALSE(sameSecret("", token));
}

}  // namespace
}  // namespace esvr::view
