// Plan: clients speak to a server that runs on a thread of the test, as bytes and over sockets. Clients
// that know the token then do what no page does: they break the protocol, send nonsense and numbers
// without bounds, stop in the middle, and do not read. Each of them loses its connection or gets an
// error, and another client is served as before.
//
// A file is put into a small page and into the bundle, and taken out again by hand.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include "field/random_field.h"
#include "render/view/server.h"
#include "render/view/view_client.h"
#include "support/messages.h"

namespace esvr::view {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using test::answerTo;
using test::drawMessage;
using test::getRequest;
using test::kUpgrade;
using test::RawClient;
using test::SocketClosed;
using test::statusOf;
using test::ViewAnswer;
using test::ViewClient;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

// The rate of messages: waits are computed by hand.

TEST(MessageRateTest, LetsABurstPassAndThenKeepsToTheRate) {
  MessageRate rate(100.0, 3.0);
  const MessageRate::Clock::time_point start{};
  for (int i = 0; i < 3; ++i) EXPECT_EQ(rate.count(start), 0ms);
  EXPECT_EQ(rate.count(start), 10ms);
  EXPECT_EQ(rate.count(start), 20ms);
  EXPECT_EQ(rate.count(start + 30ms), 0ms);
}

TEST(MessageRateTest, SavesNoMoreThanABurst) {
  MessageRate rate(100.0, 2.0);
  const MessageRate::Clock::time_point start{};
  EXPECT_EQ(rate.count(start), 0ms);
  const auto later = start + 24h;
  EXPECT_EQ(rate.count(later), 0ms);
  EXPECT_EQ(rate.count(later), 0ms);
  EXPECT_EQ(rate.count(later), 10ms);
}

// Requests and limits.

/// A server of the viewer that runs on a thread of the test.
class RunningServer {
 public:
  explicit RunningServer(const std::vector<std::filesystem::path>& files,
                         const ServerLimits& limits = {}, const cli::HostMemory& memory = {})
      : collection_(files, memory),
        token_(randomToken()),
        service_(collection_, {{boost::asio::ip::address_v4::loopback(), 0},
                               {token_, {}},
                               limits,
                               {selectDevice("cpu"), {}, {}, false, memory}}),
        thread_([this] { service_.run(); }) {}
  ~RunningServer() {
    service_.stop();
    thread_.join();
  }
  RunningServer(const RunningServer&) = delete;
  RunningServer& operator=(const RunningServer&) = delete;

  [[nodiscard]] test::ViewAddress address() const { return {service_.endpoint().port(), token_}; }

 private:
  const Collection collection_;
  const std::string token_;
  Service service_;
  std::thread thread_;
};

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
  const RunningServer server_{{files_ / "blob.esvr"}};
  const test::ViewAddress at_ = server_.address();
};

TEST_F(ServerTest, GivesThePageToThoseWhoKnowTheToken) {
  const std::string answer = answerTo(at_, getRequest(at_, page()));
  ASSERT_EQ(statusOf(answer), 200);
  EXPECT_THAT(answer, test::Says("Content-Type: text/html; charset=utf-8\r\n",
                                 "X-Content-Type-Options: nosniff\r\n",
                                 "Referrer-Policy: no-referrer\r\n", "Cache-Control: no-store\r\n",
                                 "Cross-Origin-Resource-Policy: same-origin\r\n",
                                 "Content-Security-Policy: default-src 'none'; "));
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

TEST_F(ServerTest, RefusesRequestsWithoutOneHost) {
  EXPECT_EQ(statusOf(answerTo(at_, "GET " + page() + " HTTP/1.1\r\n\r\n")), 403);
  EXPECT_EQ(statusFor(at_.host(), "Host: " + at_.host() + "\r\n"), 403);
}

TEST_F(ServerTest, RefusesForeignHostsAndOrigins) {
  EXPECT_EQ(statusFor("evil.example"), 403);
  EXPECT_EQ(status(page() + "socket", kUpgrade + std::string("Origin: null\r\n")), 403);
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

/// A server of a blob with limits of its own.
struct LimitedServer {
  explicit LimitedServer(const ServerLimits& limits, const cli::HostMemory& memory = {})
      : server({files / "blob.esvr"}, limits, memory) {}

  const test::ViewFiles files;
  const RunningServer server;
  const test::ViewAddress at = server.address();
  const std::string pageRequest = getRequest(at, "/" + at.token + "/");
};

TEST(ServerLimitsTest, ClientsBeyondTheLimitAreSentAwayUntilOneLeaves) {
  const LimitedServer server({.clients = 2});
  const auto& at = server.at;
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
  const LimitedServer server({.guestTime = std::chrono::milliseconds(50)});
  const auto& at = server.at;
  test::RawClient silent(at), half(at);
  (void)half.send("GET /" + at.token + "/ HTTP/1.1\r\nHost: 127.");
  EXPECT_EQ(silent.receive(), "");
  EXPECT_EQ(half.receive(), "");
  EXPECT_EQ(statusOf(answerTo(at, server.pageRequest)), 200);
}

TEST(ServerLimitsTest, AGuestBeyondTheLimitTakesThePlaceOfTheFirst) {
  const LimitedServer server({.guests = 2, .guestTime = std::chrono::hours(1)});
  test::RawClient first(server.at), second(server.at), third(server.at);
  EXPECT_EQ(first.receive(), "");
  for (test::RawClient* client : {&third, &second}) {
    (void)client->send(server.pageRequest);
    EXPECT_EQ(statusOf(client->receive()), 200);
  }
}

TEST(ServerLimitsTest, GuestsWithoutTheTokenKeepNobodyOut) {
  const ServerLimits limits{.guestTime = std::chrono::hours(1)};
  const LimitedServer server(limits);
  const auto& at = server.at;
  std::vector<std::unique_ptr<test::RawClient>> idle;
  for (std::size_t i = 0; i < 3 * limits.guests; ++i) {
    idle.push_back(std::make_unique<test::RawClient>(at));
    if (i % 2 == 0) (void)idle.back()->send("GET /wrong/ HTTP/1.1\r\nHost: 127.");
    if (i % 16 == 0) {
      EXPECT_EQ(statusOf(answerTo(at, server.pageRequest)), 200);
    }
  }
  test::ViewClient client(at);
  EXPECT_EQ(client.draw(test::drawMessage(1)).back().head["type"], "picture");
}

TEST(ServerLimitsTest, PicturesKeepToTheMemoryOfTheProgram) {
  constexpr std::uint64_t kBytes = 30 << 20;  // of one picture of 600 x 600, but not of two
  const LimitedServer server({}, {kBytes, {}});
  const auto message = [](int id, int side) {
    auto draw = test::drawMessage(id);
    draw["width"] = draw["height"] = side;
    return draw;
  };
  test::ViewClient first(server.at), second(server.at);
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
  const RunningServer server({files / "blob.esvr"});
  const Collection collection({files / "blob.esvr"}, {});
  const Service::Settings settings{
      {boost::asio::ip::address_v4::loopback(), server.address().port}, {}, {}, {}};
  EXPECT_THAT([&] { const Service second(collection, settings); },
              test::ThrowsSaying<RuntimeFailure>("127.0.0.1, port " +
                                                 std::to_string(server.address().port)));
}

// Messages.

constexpr const char *kJpegStart = "\xff\xd8\xff", *kPngStart = "\x89PNG\r\n\x1a\n";

class SocketTest : public testing::Test {
 protected:
  const test::ViewFiles files_;
  const RunningServer server_{{files_ / "blob.esvr", files_ / "blob.vdb", files_ / "frames.esvr"}};
  test::ViewClient client_{server_.address()};
};

TEST_F(SocketTest, DescribesTheFiles) {
  const json head = client_.ask({{"type", "describe"}}).head;
  EXPECT_THAT(head["program"].get<std::string>(), StartsWith("esvr-view "));
  EXPECT_THAT(head["device"].get<std::string>(), StartsWith("CPU"));
  ASSERT_EQ(head["files"].size(), 3u);
  EXPECT_EQ(head["files"][0]["name"], "blob.esvr");
  EXPECT_EQ(head["files"][0]["grids"][0]["kind"], "ellipsoids");
  EXPECT_EQ(head["files"][0]["grids"][0]["ellipsoids"], 8);
  EXPECT_EQ(head["files"][1]["grids"][0]["kind"], "vdb");
  EXPECT_EQ(head["files"][2]["frames"], json({7, 9}));
  EXPECT_TRUE(head["colormaps"].contains("viridis"));
  EXPECT_TRUE(head["opacities"].contains("linear"));
}

TEST_F(SocketTest, FitsCameras) {
  const json request{{"type", "fit"}, {"file", 0}, {"grid", 0}, {"width", 64}, {"height", 48}};
  const json usual = client_.ask(request).head["camera"];
  EXPECT_EQ(usual["fov"], 30.0);
  json flat = request;
  flat["view"] = "+x", flat["orthographic"] = true;
  const json side = client_.ask(flat).head["camera"];
  EXPECT_TRUE(side.contains("height"));
  EXPECT_GT(side["eye"][0], side["center"][0]);
  EXPECT_EQ(side["eye"][1], side["center"][1]);
}

TEST_F(SocketTest, RefinesAPictureUntilItIsComplete) {
  const auto pictures = client_.draw(drawMessage(5));
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const json& head = pictures[i].head;
    EXPECT_EQ(head["id"], 5);
    EXPECT_EQ(head["pass"], i + 1);
    EXPECT_EQ(head["last"], i + 1 == pictures.size());
    EXPECT_EQ(head["width"], 48);
    EXPECT_EQ(head["height"], 40);
    EXPECT_EQ(head["format"], "jpeg");
    EXPECT_GE(head["drawMs"], 0.0);
    EXPECT_EQ(head["stats"]["ellipsoids"], 8);
    EXPECT_THAT(pictures[i].bytes, StartsWith(kJpegStart));
  }
}

TEST_F(SocketTest, SendsOnePictureToAClientThatDrags) {
  json message = drawMessage(1);
  message["moving"] = true;
  const auto pictures = client_.draw(message);
  EXPECT_EQ(pictures.size(), 1u);
  EXPECT_TRUE(pictures[0].head["last"].get<bool>());
}

TEST_F(SocketTest, DrawsTheScenesOfAllMembers) {
  const std::vector<json> changes{
      {{"file", 2}, {"frame", 9}},
      {{"camera", {{"eye", {60, 8, 8}}, {"center", {8, 8, 8}}}}},
      {{"transfer",
        {{"space", "RGB"},
         {"colors", {{0, 0, 0, 0}, {1, 1, 0, 0}}},
         {"opacity", {{0, 0, 0.5, 0}, {1, 1, 0.5, 0}}}}}},
      {{"opacityLength", 9}},
      {{"mode", "maximum"}},
      {{"classification", "post"}},
      {{"shade", true}},
      {{"between", "sum"}},
      {{"background", {0, 0, 1}}},
      {{"clip", {{2, 2, 2}, {9, 9, 9}}}},
      {{"slice", {{"axis", "z"}, {"place", 8}}}},
      {{"compare", {{"file", 1}, {"show", "difference"}, {"gain", 1000}}}}};
  std::set<std::string> pictures{client_.draw(drawMessage(0)).back().bytes};
  for (const json& change : changes) {
    const ViewAnswer last = client_.draw(drawMessage(1, change)).back();
    ASSERT_EQ(last.head["type"], "picture") << last.head;
    EXPECT_TRUE(pictures.insert(last.bytes).second) << change << " changes nothing";
  }
}

TEST_F(SocketTest, MeasuresTheLastPictureOfAComparison) {
  const json change{{"compare", {{"file", 1}, {"grid", 0}, {"show", "split"}, {"split", 0.5}}}};
  const auto pictures = client_.draw(drawMessage(1, change));
  for (std::size_t i = 0; i + 1 < pictures.size(); ++i)
    EXPECT_FALSE(pictures[i].head.contains("psnr"));
  const json& last = pictures.back().head;
  // The stored threshold decides about a few faint voxels.
  EXPECT_GT(last["psnr"], 40.0);
  EXPECT_LT(last["maxDifference"], 0.1);
  EXPECT_GT(last["maxDifference"], 0.0);
}

TEST_F(SocketTest, SaysWhatCannotBeDrawn) {
  for (const auto& [change, why] : std::vector<std::pair<json, std::string>>{
           {{{"file", 3}}, "there is no file 3"},
           {{{"grid", 1}}, "there is no grid in blob.esvr of number 1"},
           {{{"file", 2}, {"frame", 8}}, "frames.esvr has no frame 8"},
           {{{"camera", {{"eye", {1, 2, 3}}, {"center", {1, 2, 3}}}}}, "eye"},
           {{{"step", 0}}, "\"scene.step\" must be from"},
           {{{"surprise", 1}}, "\"scene.surprise\" is not known"}}) {
    const json head = client_.draw(drawMessage(6, change)).back().head;
    EXPECT_EQ(head["type"], "failed");
    EXPECT_EQ(head["id"], 6);
    EXPECT_THAT(head["text"].get<std::string>(), HasSubstr(why));
  }
  EXPECT_EQ(client_.draw(drawMessage(7)).back().head["type"], "picture");
}

TEST_F(SocketTest, SendsPngFiles) {
  json message = drawMessage(3);
  message["type"] = "png";
  const ViewAnswer answer = client_.ask(message);
  EXPECT_EQ(answer.head, json({{"type", "png"}, {"id", 3}}));
  EXPECT_THAT(answer.bytes, StartsWith(kPngStart));
}

TEST_F(SocketTest, CountsValues) {
  const json all = client_.ask({{"type", "histogram"}, {"file", 1}, {"grid", 0}}).head;
  const json counts = all["histogram"]["counts"];
  const json grid = client_.ask({{"type", "describe"}}).head["files"][1]["grids"][0];
  EXPECT_EQ(counts.size(), 256u);
  std::uint64_t sum = 0;
  for (const json& count : counts) sum += count.get<std::uint64_t>();
  EXPECT_EQ(sum, grid["activeVoxels"]);
  EXPECT_EQ(all["histogram"]["low"], grid["range"][0]);
  EXPECT_EQ(all["histogram"]["high"], grid["range"][1]);
}

TEST_F(SocketTest, NamesTheCommand) {
  const json head = client_
                        .ask({{"type", "command"},
                              {"width", 64},
                              {"height", 48},
                              {"scene", {{"file", 0}, {"grid", 0}, {"shade", true}}}})
                        .head;
  EXPECT_THAT(head["text"].get<std::string>(),
              testing::AllOf(StartsWith("esvr-render "), HasSubstr("blob.esvr picture.png"),
                             HasSubstr("--resolution=64x48"), HasSubstr("--shade")));
  EXPECT_TRUE(head["transfer"].is_null());
}

TEST_F(SocketTest, ReadsPresets) {
  const json preset = {{{"Name", "mine"},
                        {"ColorSpace", "RGB"},
                        {"RGBPoints", {0, 0, 0, 0, 2, 1, 0, 0}},
                        {"Points", {0, 0, 0.5, 0, 2, 1, 0.5, 0}}}};
  const json head = client_.ask({{"type", "preset"}, {"text", preset.dump()}}).head;
  ASSERT_EQ(head["type"], "preset") << head;
  EXPECT_EQ(head["presets"][0]["name"], "mine");
  EXPECT_EQ(head["presets"][0]["transfer"]["colors"][1], json({2.0, 1.0, 0.0, 0.0}));
  EXPECT_EQ(client_.ask({{"type", "preset"}, {"text", "no preset"}}).head["type"], "failed");
}

TEST_F(SocketTest, EachClientHasItsOwnCamera) {
  const auto from = [](double x) {
    return json{{"camera", {{"eye", {x, 8, 8}}, {"center", {8, 8, 8}}}}};
  };
  std::vector<std::unique_ptr<test::ViewClient>> clients;
  std::vector<std::string> expected;
  constexpr int kClients = 4, kRounds = 5;
  for (int i = 0; i < kClients; ++i) {
    clients.push_back(std::make_unique<test::ViewClient>(server_.address()));
    expected.push_back(client_.draw(drawMessage(0, from(40 + 10 * i))).back().bytes);
  }
  for (int round = 0; round < kRounds; ++round) {
    for (int i = 0; i < kClients; ++i) clients[i]->send(drawMessage(i, from(40 + 10 * i)));
    for (int i = 0; i < kClients; ++i) {
      ViewAnswer answer = clients[i]->receive();
      while (!answer.head["last"].get<bool>()) answer = clients[i]->receive();
      EXPECT_EQ(answer.head["id"], i);
      EXPECT_TRUE(answer.bytes == expected[std::size_t(i)]) << i;
    }
  }
}

TEST_F(SocketTest, ANewerRequestReplacesThePicture) {
  constexpr int kRequests = 50;
  for (int id = 1; id <= kRequests; ++id) client_.send(drawMessage(id));
  int seen = 0, pictures = 0;
  for (bool last = false; !last || seen < kRequests; ++pictures) {
    const json head = client_.receive().head;
    ASSERT_GE(head["id"], seen) << "an old picture came after a new one";
    seen = head["id"], last = head["last"];
  }
  EXPECT_EQ(client_.ask({{"type", "describe"}}).head["type"], "description")
      << "pictures came after the last one";
}

// Hostile clients.

ServerLimits smallLimits() {
  ServerLimits limits;
  limits.messageBytes = 4096;
  limits.wrongMessages = 5;
  limits.messageBurst = limits.messagesPerSecond = 1e6;
  return limits;
}

class HostileClient : public testing::Test {
 protected:
  void TearDown() override { expectServed(); }
  void expectServed() const {
    ViewClient friendly(at_);
    EXPECT_EQ(friendly.draw(drawMessage(1)).back().head["type"], "picture");
  }
  /// A connection that was accepted as a socket.
  [[nodiscard]] std::unique_ptr<RawClient> rawSocket() const {
    auto client = std::make_unique<RawClient>(at_);
    (void)client->send(test::getRequest(at_, "/" + at_.token + "/socket", test::kUpgrade));
    EXPECT_EQ(test::statusOf(client->receive("\r\n\r\n")), 101);
    return client;
  }
  /// The server closes the connection after these bytes.
  void expectClosed(const std::string& frame) const {
    const auto client = rawSocket();
    (void)client->send(frame);
    EXPECT_NO_THROW((void)client->receive()) << testing::PrintToString(frame.substr(0, 16));
  }

  const test::ViewFiles files_;
  const RunningServer server_{{files_ / "blob.esvr", files_ / "blob.vdb"}, smallLimits()};
  const test::ViewAddress at_ = server_.address();
};

/// A frame with a mask of zeros, which leaves its bytes as they are (RFC 6455, 5.2).
std::string frame(unsigned char first, const std::string& bytes) {
  return std::string{char(first), char(0x80u | bytes.size())} + std::string(4, '\0') + bytes;
}

TEST_F(HostileClient, FramesThatBreakTheProtocolCloseTheSocket) {
  expectClosed("\x81\x02{}");                                // without a mask
  expectClosed(frame(0x83, "{}"));                           // an opcode that is reserved
  expectClosed(frame(0xc1, "{}"));                           // a bit that is reserved
  expectClosed(frame(0x80, "{}"));                           // continues nothing
  expectClosed(frame(0x81, "\xff\xfe"));                     // text that is not UTF-8
  expectClosed(frame(0x09, "x"));                            // a ping in fragments
  expectClosed(std::string("\x89\xfe\x10\x01\0\0\0\0", 8));  // a ping that is too long
}

TEST_F(HostileClient, OversizedFramesCloseTheSocketBeforeTheyArrive) {
  // The length is that of the head; no byte of the message follows.
  expectClosed(std::string("\x81\xff\x7f\xff\xff\xff\xff\xff\xff\xff\0\0\0\0", 14));
  expectClosed(std::string("\x81\xff\0\0\0\0\0\0\x10\x01\0\0\0\0", 14));  // 4097 bytes
}

TEST_F(HostileClient, OversizedMessagesOfManyFragmentsCloseTheSocket) {
  const auto client = rawSocket();
  std::string bytes = frame(0x01, std::string(100, 'x'));
  for (int i = 0; i < 100; ++i) bytes += frame(0x00, std::string(100, 'x'));
  (void)client->send(bytes);
  EXPECT_NO_THROW((void)client->receive());
}

TEST_F(HostileClient, AMessageOfTheLargestSizeIsRead) {
  ViewClient client(at_);
  std::string text = R"({"type":"preset","text":")";
  text += std::string(4096 - text.size() - 2, 'x') + "\"}";
  client.sendText(text);
  EXPECT_EQ(client.receive().head["type"], "failed");
}

TEST_F(HostileClient, ManyWrongMessagesCloseTheSocket) {
  ViewClient client(at_);
  int answers = 0;
  EXPECT_THROW(
      for (;;) {
        client.sendText("nonsense");
        EXPECT_EQ(client.receive().head["type"], "failed");
        ASSERT_LE(++answers, 5);
      },
      SocketClosed);
  EXPECT_EQ(answers, 5);
}

TEST_F(HostileClient, WrongMessagesAreNamedAndChangeNothing) {
  for (const auto& [text, why] : std::vector<std::pair<std::string, std::string>>{
           {"", "not JSON"},
           {"{", "not JSON"},
           {"{}", "\"message.type\" is not known"},
           {"[]", "must be an object"},
           {"1", "must be an object"},
           {"null", "must be an object"},
           {R"({"type":1})", "\"message.type\" must be a text"},
           {R"({"type":"erase"})", "\"message.type\" is not known"},
           {R"({"type":"draw"})", "\"draw.id\" is missing"},
           {R"({"type":"draw","id":-1})", "\"draw.id\" must be from 0"},
           {R"({"type":"draw","id":1,"width":4097,"height":1})", "\"draw.width\""},
           {R"({"type":"draw","id":1,"width":0,"height":1})", "\"draw.width\""},
           {R"({"type":"draw","id":1,"width":1.5,"height":1})", "whole number"},
           {R"({"type":"draw","id":1,"width":8,"height":8})", "\"draw.scene\" is missing"},
           {R"({"type":"draw","id":1,"width":8,"height":8,"scene":[]})", "must be an object"},
           {R"({"type":"png","id":1,"width":8,"height":8,"scene":{},"path":"/tmp/x"})",
            "\"png.path\" is not known"},
           {R"({"type":"histogram","file":"../secret.vdb"})", "\"histogram.file\""},
           {R"({"type":"histogram","file":7})", "there is no file 7"},
           {R"({"type":"fit","width":8,"height":8,"view":"up"})", "\"fit.view\" must be one of"},
           {R"({"type":"preset","text":"<a"})", "preset"},
           {R"({"type":"describe","x":1e999})", "not JSON"},
           {std::string(4000, '['), "not JSON"},
           {std::string(2000, '[') + std::string(2000, ']'), "must be an object"}}) {
    ViewClient client(at_);
    client.sendText(text);
    const json head = client.receive().head;
    EXPECT_EQ(head["type"], "failed") << text.substr(0, 80);
    EXPECT_THAT(head["text"].get<std::string>(), HasSubstr(why)) << text.substr(0, 80);
  }
}

TEST_F(HostileClient, BinaryMessagesAreWrong) {
  ViewClient client(at_);
  client.sendBinary(std::string("\0\1\2", 3));
  client.sendText(R"({"type":"describe"})");
  EXPECT_THAT(client.receive().head["text"].get<std::string>(), HasSubstr("binary"));
  EXPECT_EQ(client.receive().head["type"], "description");
}

TEST_F(HostileClient, NumbersWithoutBoundsAreDrawnOrRefused) {
  const std::vector<double> numbers{0.0, -1.0, 1e-300, 1e-30, 1e30, 1e300, -1e300, 4e9};
  test::Random random(3);
  const auto any = [&] { return numbers[std::size_t(random(0.0, double(numbers.size())))]; };
  const auto three = [&] { return json({any(), any(), any()}); };
  for (int round = 0; round < 200; ++round) {
    ViewClient client(at_);
    json scene{{"camera", {{"eye", three()}, {"center", three()}, {"up", three()}, {"fov", any()}}},
               {"opacityLength", any()},
               {"step", any()},
               {"clip", {three(), three()}},
               {"transfer",
                {{"colors", {{any(), 0, 0, 0}, {any(), any(), 0, 1}}},
                 {"opacity", {{any(), 0, 0.5, 0}, {any(), any(), any(), any()}}}}}};
    // Most of these are refused for one of their members; a scene of fewer of them goes further.
    for (const char* member : {"camera", "opacityLength", "step", "clip", "transfer"})
      if (random(0.0, 1.0) < 0.6) scene.erase(member);
    const std::string type = client.draw(drawMessage(1, scene)).back().head["type"];
    EXPECT_TRUE(type == "picture" || type == "failed");
  }
}

TEST_F(HostileClient, OnesThatLeaveInTheMiddleAreForgotten) {
  for (int i = 0; i < 50; ++i) {
    const auto client = rawSocket();
    std::string message = drawMessage(i).dump();
    const std::string bytes = std::string("\x81\xfe", 2) + char(message.size() >> 8) +
                              char(message.size() & 0xff) + std::string(4, '\0') + message;
    // Half of a message, or a message whose picture nobody reads.
    (void)client->send(i % 2 == 0 ? bytes.substr(0, bytes.size() / 2) : bytes);
  }
}

// Otherwise 64 MB of messages would be read, and 500 MB of answers would wait.
TEST_F(HostileClient, OnesThatDoNotReadAreNotRead) {
  const std::string describe = R"({"type":"describe"})";
  std::string message = std::string("\x81\xfe\x10\0", 4) + std::string(4, '\0') + describe;
  message.append(4096 - describe.size(), ' ');
  EXPECT_FALSE(rawSocket()->sendOften(message, 16'000));
}

TEST_F(HostileClient, TooManyTasksOfOneClientAreRefused) {
  ViewClient client(at_);
  json message = drawMessage(1);
  message["type"] = "png", message["width"] = message["height"] = 300;
  constexpr int kTasks = 30;
  for (int i = 0; i < kTasks; ++i) client.send(message);
  int refused = 0;
  EXPECT_THROW(
      for (int i = 0; i < kTasks; ++i) if (client.receive().head["type"] == "failed")++ refused,
      SocketClosed);
  EXPECT_GT(refused, 0);
}

// ---- The page

constexpr const char* kPage =
    "<p>before</p>\n<script id=\"esvr-file\" type=\"application/octet-stream;base64\" "
    "data-name=\"\"></script>\n<p>after</p>";

TEST(ExportedPage, HasTheFileAndItsNameInTheirPlaces) {
  EXPECT_EQ(exportedPage(kPage, "a.esvr", std::string("\0\1\2\3", 4)),
            "<p>before</p>\n<script id=\"esvr-file\" type=\"application/octet-stream;base64\" "
            "data-name=\"a.esvr\">AAECAw==</script>\n<p>after</p>");
}

TEST(ExportedPage, HasNamesThatAreNoMarkup) {
  EXPECT_THAT(exportedPage(kPage, "\"></script><b>&.esvr", "x"),
              HasSubstr("data-name=\"&quot;&gt;&lt;/script&gt;&lt;b&gt;&amp;.esvr\">eA==<"));
}

TEST(ExportedPage, OfTheBundleHasEverythingElseUnchanged) {
  const std::string_view bundle = exportPageBundle();
  const std::string page = exportedPage(bundle, "a", "xyz");
  EXPECT_EQ(page.size(), bundle.size() + 1 + 4);
  const std::size_t place = page.find("eHl6</script>");
  ASSERT_NE(place, std::string::npos);
  EXPECT_EQ(page.substr(place + 4), bundle.substr(place - 1));
}

TEST(ExportedPage, NeedsAPlace) {
  EXPECT_THROW((void)exportedPage("<p></p>", "a", "x"), std::logic_error);
}

}  // namespace

}  // namespace esvr::view
