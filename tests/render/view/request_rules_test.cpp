// Plan: tokens have the length and the digits of 128 bits and do not repeat; texts are compared
// with texts that differ in one place. Requests are judged one by one; server_test.cpp sends the
// same kinds of requests as bytes.

#include "render/view/request_rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace esvr::view {
namespace {

// The secret.

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

// Rules.

const Site kSite{"0123456789abcdef", {"render-07"}};

Request requestTo(const std::string& host, const std::string& target = "/0123456789abcdef/") {
  Request request(http::verb::get, target, 11);
  request.set(http::field::host, host);
  return request;
}

TEST(RequestRules, GiveThePageUnderEveryOwnName) {
  for (const char* host : {"localhost", "127.0.0.1:80", "[::1]:80", "[::1]", "192.168.1.7:80",
                           "render-07", "render-07:8080"})
    EXPECT_EQ(judge(requestTo(host), kSite).target, Target::kPage) << host;
}

TEST(RequestRules, RefuseOtherNames) {
  for (const char* host : {"render-08", "render-07.example", "::1]", "[::1", ""}) {
    const Verdict verdict = judge(requestTo(host), kSite);
    EXPECT_EQ(verdict.target, Target::kNothing) << host;
    EXPECT_EQ(verdict.status, http::status::forbidden) << host;
  }
}

TEST(RequestRules, TakeTheOriginOfTheHostOnly) {
  Request request = requestTo("render-07:80");
  request.set(http::field::origin, "http://render-07:80");
  EXPECT_EQ(judge(request, kSite).target, Target::kPage);
  for (const char* origin : {"http://render-07", "https://render-07:80", "http://localhost:80"}) {
    request.set(http::field::origin, origin);
    EXPECT_EQ(judge(request, kSite).status, http::status::forbidden) << origin;
  }
  request.insert(http::field::origin, "http://render-07:80");
  EXPECT_EQ(judge(request, kSite).status, http::status::forbidden) << "two origins";
}

TEST(RequestRules, SendRequestsToTheSocketThatWantOne) {
  Request request = requestTo("localhost", "/0123456789abcdef/socket");
  EXPECT_EQ(judge(request, kSite).status, http::status::upgrade_required);
  request.set(http::field::connection, "upgrade");
  request.set(http::field::upgrade, "websocket");
  EXPECT_EQ(judge(request, kSite).target, Target::kSocket);
}

// Who does not know the token learns nothing but that there is a server.
TEST(RequestRules, SayNothingMoreWithoutTheToken) {
  Request request = requestTo("localhost", "/0123456789abcdee/");
  request.method(http::verb::post);
  request.set(http::field::content_length, "5");
  EXPECT_EQ(judge(request, kSite).status, http::status::not_found);
}

}  // namespace
}  // namespace esvr::view
