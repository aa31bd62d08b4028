// Plan: scenes become the options that esvr-render would have; what is wrong is refused by the name of its
// member. Requests of the page are judged one by one; server_test.cpp sends the same kinds as bytes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <set>

#include "esvr/error.h"
#include "render/view/desk.h"
#include "render/view/requests.h"
#include "render/view/server.h"
#include "support/messages.h"

namespace esvr::view {
namespace {

using nlohmann::json;

// Scenes.

// Transfer functions.

const json kFunction{{"space", "Lab"},
                     {"colors", {{-1.5, 0.0, 0.25, 1.0}, {2.0, 1.0, 0.5, 0.0}}},
                     {"opacity", {{-1.5, 0.0, 0.5, 0.0}, {2.0, 0.75, 0.25, 1.0}}}};

TEST(TransferJson, ComesBackUnchanged) {
  for (const char* space : {"RGB", "HSV", "HSVWrap", "Lab", "Diverging", "Step"}) {
    json content = kFunction;
    content["space"] = space;
    EXPECT_EQ(jsonOf(transferOf(content)), content);
  }
}

TEST(TransferJson, OfEveryBuiltInMapIsTaken) {
  for (const std::string& colors : builtInColorMaps())
    for (const std::string& opacity : builtInOpacities()) {
      const json content = jsonOf({builtInColorMap(colors), builtInOpacity(opacity)});
      EXPECT_EQ(jsonOf(transferOf(content)), content) << colors << ' ' << opacity;
    }
}

TEST(TransferJson, IsRefusedByItsMember) {
  const auto refused = [](const char* member, const json& value) {
    json content = kFunction;
    content[member] = value;
    return [content] { (void)transferOf(content); };
  };
  const auto says = [](const char* text) { return test::ThrowsSaying<Error>(text); };
  EXPECT_THAT(refused("space", "CMYK"), says("\"transfer.space\""));
  EXPECT_THAT(refused("colors", json::array()), says("\"transfer.colors\""));
  EXPECT_THAT(refused("colors", {{1, 2, 3}}), says("\"transfer.colors\" must be a list of 4"));
  EXPECT_THAT(refused("opacity", {{1, "x", 0, 0}}), says("\"transfer.opacity\""));
  EXPECT_THAT(refused("opacity", nullptr), says("\"transfer.opacity\" is missing"));
  EXPECT_THAT(refused("points", 1), says("\"transfer.points\" is not known"));
  json many = json::array();
  for (int i = 0; i < 3000; ++i) many.push_back({i, 0, 0, 0});
  EXPECT_THAT(refused("colors", many), says("1 to 2048 points"));
}

// Scenes.

TEST(SceneJson, HasTheDefaultsOfEsvrRender) {
  const SceneWish wish = sceneOf(json::object());
  const render::Options usual;
  EXPECT_EQ(wish.place, GridPlace{});
  EXPECT_FALSE(wish.options.camera.eye);
  EXPECT_FALSE(wish.options.look.transfer);
  EXPECT_EQ(wish.options.step, usual.step);
  EXPECT_EQ(wish.options.opacityLength, usual.opacityLength);
  EXPECT_EQ(wish.options.mode, usual.mode);
  EXPECT_EQ(wish.options.classification, usual.classification);
  EXPECT_EQ(wish.options.lod, usual.lod);
  EXPECT_EQ(wish.options.between, usual.between);
  EXPECT_FALSE(wish.options.shading || wish.options.clip || wish.options.background ||
               wish.compare);
}

TEST(SceneJson, HasItsMembers) {
  const SceneWish wish = sceneOf(json::parse(R"({
      "file": 1, "grid": 2, "frame": -3, "step": 0.5, "opacityLength": 4, "mode": "average",
      "classification": "post", "shade": true, "lod": "off", "between": "sum",
      "camera": {"eye": [1, 2, 3], "center": [4, 5, 6], "height": 7},
      "background": [0.25, 0.5, 1], "clip": [[0, 1, 2], [3, 4, 5]],
      "compare": {"file": 3, "grid": 1, "show": "difference", "gain": 20, "split": 0.25}})"));
  EXPECT_EQ(wish.place, (GridPlace{1, 2, -3}));
  const render::Options& o = wish.options;
  EXPECT_EQ(o.step, 0.5);
  EXPECT_EQ(o.opacityLength, 4.0);
  EXPECT_EQ(o.mode, RenderMode::kAverage);
  EXPECT_EQ(o.classification, Classification::kPost);
  EXPECT_EQ(o.lod, LevelOfDetail::kOff);
  EXPECT_EQ(o.between, Between::kSum);
  EXPECT_TRUE(o.shading.has_value());
  EXPECT_EQ(o.camera.eye, (Vec3{1, 2, 3}));
  EXPECT_EQ(o.camera.height, 7.0);
  EXPECT_EQ(o.camera.projection, Projection::kOrthographic);
  EXPECT_EQ(o.background->g, 0.5);
  EXPECT_EQ(o.clip->high, (Vec3{3, 4, 5}));
  ASSERT_TRUE(wish.compare);
  EXPECT_EQ(wish.compare->with, (GridPlace{3, 1, std::nullopt}));
  EXPECT_EQ(wish.compare->show, CompareShow::kDifference);
  EXPECT_EQ(wish.compare->gain, 20.0);
  EXPECT_EQ(wish.compare->split, 0.25);
}

TEST(SceneJson, OfASliceHasTheRaysOfEsvrRender) {
  const SceneWish wish = sceneOf(json::parse(R"({"slice": {"axis": "y", "place": 12.5}})"));
  EXPECT_EQ(wish.sliceAxis, 1u);
  EXPECT_EQ(wish.slicePlace, 12.5);
  EXPECT_EQ(wish.options.clip->low[1], 12.0);
  EXPECT_EQ(wish.options.clip->high[1], 13.0);
  EXPECT_EQ(wish.options.classification, Classification::kPost);
  EXPECT_EQ(wish.options.lod, LevelOfDetail::kOff);
}

TEST(SceneJson, IsRefusedByItsMember) {
  for (const auto& [text, why] : std::vector<std::pair<const char*, const char*>>{
           {R"({"file": -1})", "\"scene.file\""},
           {R"({"frame": 0.5})", "\"scene.frame\" must be a whole number"},
           {R"({"camera": 1})", "\"scene.camera\""},
           {R"({"camera": {"eye": [1, 2]}})", "\"scene.camera\""},
           {R"({"camera": {"path": "x"}})", "\"scene.camera\""},
           {R"({"mode": "best"})", "\"scene.mode\" must be one of composite, maximum, average"},
           {R"({"shade": 1})", "\"scene.shade\" must be true or false"},
           {R"({"background": [0, 0, 2]})", "\"scene.background\""},
           {R"({"clip": [[0, 0, 0]]})", "\"scene.clip\""},
           {R"({"slice": {"axis": "w", "place": 1}})", "\"scene.slice.axis\""},
           {R"({"slice": {"axis": "x"}})", "\"scene.slice.place\" is missing"},
           {R"({"slice": {"axis": "x", "place": 1}, "clip": [[0,0,0],[1,1,1]]})", "not both"},
           {R"({"compare": {"split": 2}})", "\"scene.compare.split\""},
           {R"({"compare": {"path": "x"}})", "\"scene.compare.path\" is not known"}})
    EXPECT_THAT([text = text] { (void)sceneOf(json::parse(text)); },
                test::ThrowsSaying<Error>(why));
}

TEST(CameraJson, ComesBackAsTheSameCamera) {
  Camera camera{{1.5, 2, 3}, {4, 5, 6}, {0, 0, 1}, Projection::kPerspective, 40.0, 1.0};
  const SceneWish wish = sceneOf({{"camera", jsonOf(camera)}});
  EXPECT_EQ(wish.options.camera.eye, camera.eye);
  EXPECT_EQ(wish.options.camera.center, camera.center);
  EXPECT_EQ(wish.options.camera.up, camera.up);
  EXPECT_EQ(wish.options.camera.fov, camera.fov);
}

// Requests of pages.

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
  for (const char* host : {"localhost", "localhost:8080", "127.0.0.1", "127.0.0.1:80", "[::1]:80",
                           "[::1]", "192.168.1.7:80", "render-07", "render-07:8080"})
    EXPECT_EQ(judge(requestTo(host), kSite).target, Target::kPage) << host;
}

// A page of another site may have a name that its owner lets point to this machine.
TEST(RequestRules, RefuseOtherNames) {
  for (const char* host :
       {"render-08", "render-07.example", "::1]", "[::1", "", "evil.example", "evil.example:80",
        "localhost.evil.example", "127.0.0.1.evil.example", "127.0.0.1evil"}) {
    const Verdict verdict = judge(requestTo(host), kSite);
    EXPECT_EQ(verdict.target, Target::kNothing) << host;
    EXPECT_EQ(verdict.status, http::status::forbidden) << host;
  }
}

TEST(RequestRules, TakeTheOriginOfTheHostOnly) {
  Request request = requestTo("render-07:80");
  request.set(http::field::origin, "http://render-07:80");
  EXPECT_EQ(judge(request, kSite).target, Target::kPage);
  for (const char* origin : {"http://render-07", "https://render-07:80", "http://localhost:80",
                             "http://evil.example", "null", ""}) {
    request.set(http::field::origin, origin);
    EXPECT_EQ(judge(request, kSite).status, http::status::forbidden) << origin;
  }
  request.insert(http::field::origin, "http://render-07:80");
  EXPECT_EQ(judge(request, kSite).status, http::status::forbidden) << "two origins";
}

// Who does not know the token learns nothing but that there is a server.
TEST(RequestRules, SayNothingMoreWithoutTheToken) {
  Request request = requestTo("localhost", "/0123456789abcdee/");
  request.method(http::verb::post);
  request.set(http::field::content_length, "5");
  EXPECT_EQ(judge(request, kSite).status, http::status::not_found);
}

// Command lines.

TEST(LookNames, AreFoundOverAnyRange) {
  for (const ValueRange range : {ValueRange{0.0f, 1.0f}, ValueRange{-3.5f, 1e6f}}) {
    const auto names =
        namesOf(rescaled({builtInColorMap("inferno"), builtInOpacity("linear")}, range));
    ASSERT_TRUE(names);
    EXPECT_EQ(names->colors, "inferno");
    EXPECT_EQ(names->opacity, "linear");
    EXPECT_EQ(names->range.min, range.min);
    EXPECT_EQ(names->range.max, range.max);
  }
}

TEST(LookNames, AreNoneIfOnePointIsChanged) {
  TransferFunction f{builtInColorMap("viridis"), builtInOpacity("linear")};
  ASSERT_TRUE(namesOf(f));
  TransferFunction other = f;
  other.opacity.back().opacity -= 0.01;
  EXPECT_FALSE(namesOf(other));
  other = f;
  other.colors.points[1].color.g += 0.01;
  EXPECT_FALSE(namesOf(other));
  other = f;
  other.colors.points.front().x -= 0.01;
  EXPECT_FALSE(namesOf(other));
}

}  // namespace
}  // namespace esvr::view
