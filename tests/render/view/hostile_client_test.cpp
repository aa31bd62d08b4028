// Plan: clients that know the token do what no page does: they break the protocol, send nonsense and
// numbers without bounds, stop in the middle, and do not read. Each of them loses its connection or
// gets an error, and another client is served as before.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "field/random_field.h"
#include "render/view/running_server.h"
#include "render/view/view_files.h"

namespace esvr::view {
namespace {

using nlohmann::json;
using test::drawMessage;
using test::RawClient;
using test::SocketClosed;
using test::ViewClient;
using testing::HasSubstr;

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
  const test::RunningServer server_{{files_ / "blob.esvr", files_ / "blob.vdb"}, smallLimits()};
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

}  // namespace
}  // namespace esvr::view
