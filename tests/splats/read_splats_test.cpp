// Plan: the same two splats are written in every form that a PLY file may have and read back: both byte orders, text,
// other types, another order of properties, elements and lists beside them, other line ends. The numbers must be
// those that were written, to the rounding of float32. What is no file of splats is refused with a text that says
// why.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "esvr/error.h"
#include "esvr/splats.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(),
                 kInfinity = std::numeric_limits<double>::infinity();

std::vector<std::string> usualNames() {
  return {"x",       "y",       "z",       "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
          "scale_0", "scale_1", "scale_2", "rot_0",  "rot_1",  "rot_2",  "rot_3"};
}
std::vector<double> usualRow() { return {1, 2, -3, 0.5, -0.5, 0, 0.25, -1, -2, -1.5, -2, 0, 0, 2}; }

/// A PLY file that is written number by number.
struct PlyText {
  std::string format = "ascii", type = "float", lineEnd = "\n", extra{};
  std::vector<std::string> names = usualNames();
  std::vector<std::vector<double>> rows{usualRow()};
  std::string before{};  ///< rows of elements before the vertices

  template <class T>
  std::string number(T value) const {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &value, sizeof(T));
    if (format == "binary_big_endian") std::reverse(bytes.begin(), bytes.end());
    return {bytes.data(), bytes.size()};
  }
  std::string word(double value) const {
    if (format == "ascii") return std::to_string(value) + ' ';
    return type == "double" ? number(value) : number(float(value));
  }
  std::string text() const {
    std::string all = "ply\nformat " + format + " 1.0\ncomment made by a test\n" + extra +
                      "element vertex " + std::to_string(rows.size()) + '\n';
    for (const auto& name : names) all += "property " + type + ' ' + name + '\n';
    all += "end_header\n";
    if (lineEnd != "\n")
      for (std::size_t at = 0; (at = all.find('\n', at)) != all.npos; at += lineEnd.size())
        all.replace(at, 1, lineEnd);
    all += before;
    for (const auto& row : rows) {
      for (const double value : row) all += word(value);
      if (format == "ascii") all += lineEnd;
    }
    return all;
  }
};

SplatFile parse(const std::string& text, const SplatReadOptions& options = {}) {
  return parseSplats(std::as_bytes(std::span(text)), "in.ply", options);
}

void expectUsual(const SplatFile& file) {
  const Splats& s = file.scene.splats;
  ASSERT_EQ(s.size(), 1u);
  EXPECT_EQ(s.center[0][0], 1.0f);
  EXPECT_EQ(s.center[2][0], -3.0f);
  EXPECT_EQ(s.logScale[1][0], -2.0f);
  EXPECT_NEAR(s.alpha[0], 1.0 / (1.0 + std::exp(-0.25)), 1e-7);
  EXPECT_NEAR(s.color[0][0], 0.5 + 0.28209479 * 0.5, 1e-6);
  EXPECT_NEAR(s.rotation[0][0], std::sqrt(0.5), 1e-7);  // normalised, with w above 0
  EXPECT_NEAR(s.rotation[3][0], -std::sqrt(0.5), 1e-7);
}

TEST(ReadSplats, TakesBothByteOrdersAndTextAndDoubles) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"})
    for (const char* type : {"float", "double"})
      for (const char* lineEnd : {"\n", "\r\n"}) {
        SCOPED_TRACE(std::string(format) + ' ' + type);
        expectUsual(parse(PlyText{.format = format, .type = type, .lineEnd = lineEnd}.text()));
      }
}

TEST(ReadSplats, TakesPropertiesInAnyOrder) {
  PlyText ply{.format = "binary_little_endian"};
  std::reverse(ply.names.begin(), ply.names.end());
  std::reverse(ply.rows[0].begin(), ply.rows[0].end());
  ply.names.insert(ply.names.begin() + 3, "nx");
  ply.rows[0].insert(ply.rows[0].begin() + 3, 9.0);
  ply.names.emplace_back("f_rest_0");
  ply.rows[0].push_back(9.0);
  const SplatFile file = parse(ply.text());
  expectUsual(file);
  EXPECT_TRUE(file.hasHigherDegrees);
}

TEST(ReadSplats, PassesOverElementsAndListsBeforeTheVertices) {
  PlyText ply{.format = "binary_big_endian",
              .extra =
                  "obj_info none\nelement chunk 2\nproperty uchar a\nproperty short b\n"
                  "element face 1\nproperty list uchar int vertex_indices\n"};
  ply.before = std::string("\1\0\2\3\0\4", 6) + '\3' + std::string(12, 'x');
  expectUsual(parse(ply.text()));
  ply.format = "ascii";
  ply.before = "1 2\n3 4\n3 7 8 9\n";
  expectUsual(parse(ply.text()));
}

TEST(ReadSplats, DropsAndCountsWhatIsNotFinite) {
  PlyText ply{.format = "binary_little_endian"};
  for (const std::size_t slot : {0u, 3u, 6u, 7u, 10u}) {
    ply.rows.push_back(usualRow());
    ply.rows.back()[slot] = kNan;
  }
  ply.rows.push_back(usualRow());
  ply.rows.back()[1] = kInfinity;
  ply.rows.push_back(usualRow());
  for (const std::size_t slot : {10u, 13u}) ply.rows.back()[slot] = 0.0;  // no quaternion
  ply.rows.push_back(usualRow());
  ply.rows.back()[8] = 80.0;  // a size beyond all grids
  const SplatFile file = parse(ply.text());
  expectUsual(file);
  EXPECT_EQ(file.inFile, 9u);
  EXPECT_EQ(file.dropped, 8u);
}

TEST(ReadSplats, TakesAnOpaqueFlatSplat) {
  PlyText ply{.format = "binary_little_endian"};
  ply.rows[0][6] = kInfinity;   // alpha 1
  ply.rows[0][8] = -kInfinity;  // no thickness
  const SplatFile file = parse(ply.text());
  EXPECT_EQ(file.rounded, 1u);
  EXPECT_EQ(file.scene.splats.alpha[0], 1.0f);
  EXPECT_NEAR(file.scene.splats.logScale[1][0], -1.0 - std::log(kMostFlat), 1e-6);
}

TEST(ReadSplats, WithoutColorsHaveNone) {
  PlyText ply;
  ply.names.erase(ply.names.begin() + 3, ply.names.begin() + 6);
  ply.rows[0].erase(ply.rows[0].begin() + 3, ply.rows[0].begin() + 6);
  EXPECT_FALSE(parse(ply.text()).scene.splats.hasColors());
}

TEST(ReadSplats, RefusesWhatIsNoFileOfSplatsAndSaysWhy) {
  const auto expectRefusal = [](const std::string& text, const char* why) {
    try {
      (void)parse(text);
      ADD_FAILURE() << why;
    } catch (const BadInput& error) {
      EXPECT_THAT(error.what(), HasSubstr(why));
    }
  };
  const std::string usual = PlyText{.format = "binary_little_endian"}.text();
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string text = usual;
    return text.replace(text.find(from), from.size(), to);
  };
  expectRefusal("", "no PLY file");
  expectRefusal("solid cube\n", "no PLY file");
  expectRefusal("ply\nformat ascii 1.0\n", "no end");
  expectRefusal(replaced("binary_little_endian", "binary_middle_endian"),
                "format 'binary_middle_endian'");
  expectRefusal(replaced("1.0", "2.0"), "version 2.0");
  expectRefusal(replaced("opacity", "opaque"), "no property opacity");
  expectRefusal(replaced("f_dc_1", "f_dc_7"), "some of f_dc_0");
  expectRefusal(replaced("f_dc_1", "x"), "twice");
  expectRefusal(replaced("property float x", "property vec3 x"), "unknown type");
  expectRefusal(replaced("vertex 1", "vertex 2"), "too short");
  expectRefusal(replaced("vertex 1", "vertex 9000000000000000000"), "too short");
  expectRefusal(replaced("vertex 1", "vertex -1"), "number '-1'");
  expectRefusal(replaced("vertex 1", "point 1"), "no element 'vertex'");
  expectRefusal(replaced("property float x", "property uint packed_position"), "compressed");
  expectRefusal(usual.substr(0, usual.size() - 1), "too short");
  expectRefusal(replaced("comment made by a test", "comment esvr_to_world 1 2 3"), "16 numbers");
  expectRefusal(
      replaced("comment made by a test", "comment esvr_to_world 1 0 0 0 0 2 0 0 0 0 1 0 0 0 0 1"),
      "no rotation");
  PlyText text;
  text.rows[0].pop_back();
  expectRefusal(text.text() + "word", "no number");
  text.rows = {std::vector<double>(14, kNan)};
  text.format = "binary_little_endian";
  expectRefusal(text.text(), "none of its 1 splats");
}

TEST(ReadSplats, RefusesMoreSplatsThanTheMemoryHolds) {
  PlyText ply{.format = "binary_little_endian"};
  ply.rows.resize(1000, usualRow());
  EXPECT_THROW((void)parse(ply.text(), {.maxBytes = 10000}), MemoryExceeded);
}

TEST(ReadSplats, TurnsFilesWithYDownToTheWorld) {
  const auto world = [](const std::optional<UpAxis>& up) {
    const auto m = parse(PlyText{}.text(), {.up = up}).scene.toWorld;
    std::array<double, 3> place{};  // of the point (1, 2, 3) of a file
    for (std::size_t c = 0; c < 3; ++c) place[c] = 1 * m[c] + 2 * m[4 + c] + 3 * m[8 + c];
    return place;
  };
  EXPECT_EQ(world(UpAxis::kY), (std::array{1.0, -2.0, -3.0}));
  EXPECT_EQ(world(UpAxis::kZ), (std::array{1.0, 3.0, -2.0}));
  EXPECT_EQ(world(std::nullopt), (std::array{1.0, 2.0, 3.0}));
}

}  // namespace
}  // namespace esvr
