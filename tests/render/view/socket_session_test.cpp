// Plan: clients speak to a server that runs on a thread of the test. Every kind of message has its
// answer; pictures become finer until the last one; each client gets the pictures of its own camera.

#include "render/view/socket_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "render/view/running_server.h"
#include "render/view/view_files.h"

namespace esvr::view {
namespace {

using nlohmann::json;
using test::drawMessage;
using test::ViewAnswer;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char *kJpegStart = "\xff\xd8\xff", *kPngStart = "\x89PNG\r\n\x1a\n";

class SocketTest : public testing::Test {
 protected:
  const test::ViewFiles files_;
  const test::RunningServer server_{
      {files_ / "blob.esvr", files_ / "blob.vdb", files_ / "frames.esvr"}};
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

}  // namespace
}  // namespace esvr::view
