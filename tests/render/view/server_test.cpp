// Plan: requests are sent as bytes to a server that runs on a thread of the test. What is accepted is
// the page and a socket, with the token, from this machine's names only.

#include "render/view/server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "render/view/page.h"
#include "render/view/running_server.h"
#include "render/view/view_files.h"

namespace esvr::view {
namespace {

using test::answerTo;
using test::getRequest;
using test::kUpgrade;
using test::statusOf;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class ServerTest : public testing::Test {
 protected:
  [[nodiscard]] int status(const std::string& target, const std::string& lines = "") const {
    return statusOf(answerTo(at_, getRequest(at_, target, lines)));
  }
  [[nodiscard]] std::string page() const { return "/" + at_.token + "/"; }
  [[nodiscard]] int statusFor(const std::string& host, const std::string& lines = "") const {
    return statusOf(
        answerTo(at_, "GET " + page() + " HTTP/1.1\r\nHost: " + host + "\r\n" + lines + "\r\n"));
  }

  const test::ViewFiles files_;
  const test::RunningServer server_{{files_ / "blob.esvr"}};
  const test::ViewAddress at_ = server_.address();
};

TEST_F(ServerTest, GivesThePageToThoseWhoKnowTheToken) {
  const std::string answer = answerTo(at_, getRequest(at_, page()));
  ASSERT_EQ(statusOf(answer), 200);
  EXPECT_THAT(answer, AllOf(HasSubstr("Content-Type: text/html; charset=utf-8\r\n"),
                            HasSubstr("X-Content-Type-Options: nosniff\r\n"),
                            HasSubstr("Referrer-Policy: no-referrer\r\n"),
                            HasSubstr("Cache-Control: no-store\r\n"),
                            HasSubstr("Cross-Origin-Resource-Policy: same-origin\r\n"),
                            HasSubstr("Content-Security-Policy: default-src 'none'; ")));
  EXPECT_THAT(answer, HasSubstr(std::string(viewPage().substr(viewPage().rfind('<')))));
}

TEST_F(ServerTest, HasNothingElse) {
  for (const std::string& target :
       {std::string("/"), std::string("/favicon.ico"), "/" + at_.token, page() + "x",
        page() + "socket/", page() + "../", page() + "?x", std::string("*"), page() + "/etc/passwd",
        "/" + std::string(at_.token.size(), '0') + "/"})
    EXPECT_EQ(status(target), 404) << target;
}

TEST_F(ServerTest, RefusesATokenThatIsWrongInOneDigitOrShorter) {
  std::string wrong = at_.token;
  wrong.back() = wrong.back() == '0' ? '1' : '0';
  for (const std::string& token : {wrong, at_.token.substr(1), at_.token + "0", std::string()}) {
    EXPECT_EQ(status("/" + token + "/"), 404) << token;
    EXPECT_EQ(status("/" + token + "/socket", kUpgrade), 404) << token;
  }
}

// A page of another site may have a name that its owner lets point to this machine.
TEST_F(ServerTest, RefusesForeignHosts) {
  for (const char* host : {"evil.example", "evil.example:80", "localhost.evil.example",
                           "127.0.0.1.evil.example", "", "[::1", "127.0.0.1evil"})
    EXPECT_EQ(statusFor(host), 403) << host;
  for (const char* host : {"localhost", "localhost:8080", "127.0.0.1", "[::1]:80"})
    EXPECT_EQ(statusFor(host), 200) << host;
}

TEST_F(ServerTest, RefusesRequestsWithoutOneHost) {
  EXPECT_EQ(statusOf(answerTo(at_, "GET " + page() + " HTTP/1.1\r\n\r\n")), 403);
  EXPECT_EQ(statusFor(at_.host(), "Host: " + at_.host() + "\r\n"), 403);
}

TEST_F(ServerTest, RefusesForeignOrigins) {
  for (const std::string origin :
       {"http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1", ""})
    EXPECT_EQ(status(page() + "socket", kUpgrade + ("Origin: " + origin + "\r\n")), 403) << origin;
  EXPECT_EQ(status(page(), "Origin: http://" + at_.host() + "\r\n"), 200);
}

TEST_F(ServerTest, RefusesMethodsAndBodies) {
  for (const char* method : {"POST", "PUT", "DELETE", "HEAD", "OPTIONS", "PATCH"}) {
    const std::string head = std::string(method) + " " + page() + " HTTP/1.1\r\nHost: ";
    EXPECT_EQ(statusOf(answerTo(at_, head + at_.host() + "\r\n\r\n")), 405) << method;
  }
  EXPECT_EQ(status(page(), "Content-Length: 10\r\n"), 413);
  EXPECT_EQ(status(page(), "Transfer-Encoding: chunked\r\n"), 413);
}

TEST_F(ServerTest, RefusesLargeHeads) {
  EXPECT_EQ(status(page(), "X: " + std::string(9000, 'x') + "\r\n"), 431);
  EXPECT_EQ(status("/" + std::string(9000, 'x')), 431);
}

TEST_F(ServerTest, RefusesWhatIsNotHttp) {
  EXPECT_EQ(statusOf(answerTo(at_, "nonsense\r\n\r\n")), 400);
  EXPECT_EQ(statusOf(answerTo(at_, std::string(100, '\0') + "\r\n\r\n")), 400);
  // A browser that is told https: begins so.
  EXPECT_THAT(answerTo(at_, std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11)),
              Not(HasSubstr("200")));
}

TEST_F(ServerTest, WantsASocketWhereThereIsOne) { EXPECT_EQ(status(page() + "socket"), 426); }

TEST_F(ServerTest, SendsTheWholeAnswerToAClientThatSendsALargeBody) {
  test::RawClient client(at_);
  const std::string body(std::size_t{4} << 20, 'x');
  (void)client.send("POST " + page() + " HTTP/1.1\r\nHost: " + at_.host() +
                    "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n");
  (void)client.send(body);
  EXPECT_EQ(statusOf(client.receive()), 405);
}

TEST(ServerLimitsTest, ClientsBeyondTheLimitAreSentAwayUntilOneLeaves) {
  const test::ViewFiles files;
  ServerLimits limits;
  limits.clients = 2;
  const test::RunningServer server({files / "blob.esvr"}, limits);
  const auto at = server.address();
  const std::string request = getRequest(at, "/" + at.token + "/socket", kUpgrade);
  {
    test::ViewClient first(at), second(at);
    EXPECT_EQ(statusOf(answerTo(at, request)), 503);
    EXPECT_EQ(first.ask({{"type", "describe"}}).head["type"], "description");
  }
  // The server notices the end of a connection a moment later.
  int status = 503;
  for (int attempt = 0; attempt < 1000 && status == 503; ++attempt) {
    test::RawClient next(at);
    (void)next.send(request);
    status = statusOf(next.receive("\r\n"));
  }
  EXPECT_EQ(status, 101);
}

TEST(ServerLimitsTest, HalfRequestsAreClosedAfterTheirTime) {
  const test::ViewFiles files;
  ServerLimits limits;
  limits.guestTime = std::chrono::milliseconds(50);
  const test::RunningServer server({files / "blob.esvr"}, limits);
  const auto at = server.address();
  test::RawClient silent(at), half(at);
  (void)half.send("GET /" + at.token + "/ HTTP/1.1\r\nHost: 127.");
  EXPECT_EQ(silent.receive(), "");
  EXPECT_EQ(half.receive(), "");
  EXPECT_EQ(statusOf(answerTo(at, getRequest(at, "/" + at.token + "/"))), 200);
}

TEST(ServerLimitsTest, AGuestBeyondTheLimitTakesThePlaceOfTheFirst) {
  const test::ViewFiles files;
  ServerLimits limits;
  limits.guests = 2;
  limits.guestTime = std::chrono::hours(1);
  const test::RunningServer server({files / "blob.esvr"}, limits);
  const auto at = server.address();
  test::RawClient first(at), second(at), third(at);
  EXPECT_EQ(first.receive(), "");
  (void)third.send(getRequest(at, "/" + at.token + "/"));
  EXPECT_EQ(statusOf(third.receive()), 200);
  (void)second.send(getRequest(at, "/" + at.token + "/"));
  EXPECT_EQ(statusOf(second.receive()), 200);
}

TEST(ServerLimitsTest, GuestsWithoutTheTokenKeepNobodyOut) {
  const test::ViewFiles files;
  ServerLimits limits;
  limits.guestTime = std::chrono::hours(1);
  const test::RunningServer server({files / "blob.esvr"}, limits);
  const auto at = server.address();
  std::vector<std::unique_ptr<test::RawClient>> idle;
  for (std::size_t i = 0; i < 3 * limits.guests; ++i) {
    idle.push_back(std::make_unique<test::RawClient>(at));
    if (i % 2 == 0) (void)idle.back()->send("GET /wrong/ HTTP/1.1\r\nHost: 127.");
    if (i % 16 == 0) {
      EXPECT_EQ(statusOf(answerTo(at, getRequest(at, "/" + at.token + "/"))), 200);
    }
  }
  test::ViewClient client(at);
  EXPECT_EQ(client.draw(test::drawMessage(1)).back().head["type"], "picture");
}

TEST(ServerLimitsTest, PicturesKeepToTheMemoryOfTheProgram) {
  const test::ViewFiles files;
  constexpr std::uint64_t kBytes = 30 << 20;  // of one picture of 600 x 600, but not of two
  const test::RunningServer server({files / "blob.esvr"}, {}, {kBytes, {}});
  const auto message = [](int id, int side) {
    auto draw = test::drawMessage(id);
    draw["width"] = draw["height"] = side;
    return draw;
  };
  test::ViewClient first(server.address()), second(server.address());
  first.send(message(1, 600)), second.send(message(2, 600));
  // Each gets its last picture, although only one of them has room between two passes.
  for (test::ViewClient* client : {&first, &second}) {
    nlohmann::json head;
    do head = client->receive().head;
    while (head["type"] == "picture" && head["last"] == false);
    EXPECT_EQ(head["type"], "picture") << head;
  }
  const auto refused = first.draw(message(3, 1000)).back().head;
  EXPECT_EQ(refused["type"], "failed");
  EXPECT_THAT(refused["text"].get<std::string>(), HasSubstr("1000 x 1000 pixels"));
}

TEST(ServerStart, SaysWhichAddressCannotBeUsed) {
  const test::ViewFiles files;
  const test::RunningServer server({files / "blob.esvr"});
  const Collection collection({files / "blob.esvr"}, {});
  const Service::Settings settings{
      {boost::asio::ip::address_v4::loopback(), server.address().port}, {}, {}, {}};
  EXPECT_THAT([&] { const Service second(collection, settings); },
              testing::ThrowsMessage<RuntimeFailure>(
                  HasSubstr("127.0.0.1, port " + std::to_string(server.address().port))));
}

}  // namespace
}  // namespace esvr::view
