// Plan: functions go to JSON and back unchanged, and wrong ones are refused by the name of their
// member.

#include "render/view/transfer_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/error.h"

namespace esvr::view {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::ThrowsMessage;

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
  const auto says = [](const char* text) { return ThrowsMessage<Error>(HasSubstr(text)); };
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

}  // namespace
}  // namespace esvr::view
