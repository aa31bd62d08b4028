// Plan: what is written is read back. The files for other programs are held against what these programs read:
//
// - The prim of a USD file has the properties of the schema ParticleField3DGaussianSplat with their types, and none
//   besides (pxr/usd/usdVol/schema.usda and usdGeom/schema.usda of OpenUSD 26.05). Arrays have one element a splat.
//   Numbers mean what the schema says: opacities and scales are linear, a quaternion begins with its real part, a
//   color is its coefficient of degree 0 times the constant harmonic, plus a half.
// - A PLY file for Mitsuba 3 is read by the steps of its reader (src/shapes/ellipsoids.h and ply.h of Mitsuba 3.9.1),
//   which finds properties by their places.
//
// The same two splats are written in every form that a PLY file may have and read back: both byte orders, text,
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
#include <map>
#include <span>
#include <sstream>

#include "esvr/error.h"
#include "esvr/splats.h"
#include "support/files.h"
#include "support/messages.h"

namespace esvr {
namespace {

using testing::HasSubstr;

constexpr double kConstantHarmonic = 0.28209479177387814;  // 1 / (2 sqrt(pi))

SplatScene someScene() {
  SplatScene scene;
  scene.name = "smoke 1";
  scene.up = UpAxis::kZ;
  scene.densityScale = 0.375;
  scene.toWorld = {0, 0.1, 0, 0, -0.1, 0, 0, 0, 0, 0, 0.1, 0, 5, 6, 7, 1};
  scene.indexToWorld = {0, 0.3, 0, 0, -0.1, 0, 0, 0, 0, 0.05, 0.7, 0, 1, 2, 1.0 / 3, 1};
  scene.splats.resize(2, true);
  for (std::size_t i = 0; i < 2; ++i) {
    const float k = float(i);
    scene.splats.center[0][i] = 1.5f + k, scene.splats.center[1][i] = -2.25f,
    scene.splats.center[2][i] = 1e-7f;
    scene.splats.logScale[0][i] = -1.0f, scene.splats.logScale[1][i] = -2.0f - k,
    scene.splats.logScale[2][i] = -3.0f;
    scene.splats.rotation[0][i] = 0.6f, scene.splats.rotation[2][i] = 0.8f;
    scene.splats.alpha[i] = 0.25f + 0.5f * k;
    for (std::size_t c = 0; c < 3; ++c) scene.splats.color[c][i] = 0.25f * float(c + 1);
  }
  return scene;
}

std::string written(SplatForm form, const SplatScene& scene = someScene()) {
  const test::TemporaryFolder folder;
  writeSplats(folder / "out", scene, form);
  return test::readText(folder / "out");
}

TEST(WriteSplats, AreReadBackWithTheirPlaceInTheWorld) {
  const test::TemporaryFolder folder;
  const SplatScene scene = someScene();
  for (const SplatForm form : {SplatForm::kPly, SplatForm::kMitsuba}) {
    writeSplats(folder / "out.ply", scene, form, true);
    const SplatFile back = readSplats(folder / "out.ply");
    EXPECT_TRUE(back.hasPlacement);
    EXPECT_EQ(back.scene.toWorld, scene.toWorld);
    EXPECT_EQ(back.scene.indexToWorld, scene.indexToWorld);
    EXPECT_EQ(back.scene.up, UpAxis::kZ);
    EXPECT_EQ(back.scene.densityScale, 0.375);
    EXPECT_EQ(back.scene.name, "smoke 1");
    EXPECT_EQ(back.scene.splats.center, scene.splats.center);
    EXPECT_EQ(back.scene.splats.logScale, scene.splats.logScale);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_NEAR(back.scene.splats.alpha[i], scene.splats.alpha[i], 1e-7);
      EXPECT_NEAR(back.scene.splats.color[2][i], 0.75, 1e-6);
      EXPECT_NEAR(back.scene.splats.rotation[2][i], 0.8, 1e-7);
    }
  }
  EXPECT_THROW(writeSplats(folder / "out.ply", scene, SplatForm::kPly),
               RuntimeFailure);  // it exists
}

TEST(WriteSplats, GiveViewersTheHeaderThatAllOfThemRead) {
  const std::string text = written(SplatForm::kPly),
                    header = text.substr(0, text.find("end_header\n") + 11);
  EXPECT_THAT(header, testing::StartsWith("ply\nformat binary_little_endian 1.0\n"));
  std::string properties = "element vertex 2\n";
  for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0",
                           "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
    properties += std::string("property float ") + name + '\n';
  EXPECT_THAT(header, HasSubstr(properties + "end_header\n"));
  EXPECT_EQ(text.size(), header.size() + 2 * 14 * sizeof(float));
}

TEST(WriteSplats, RefuseWhatReadersWouldRefuseOrLeaveOut) {
  const test::TemporaryFolder folder;
  const auto expectRefusal = [&](const auto& change, const char* why) {
    SplatScene scene = someScene();
    change(scene);
    EXPECT_THAT([&] { writeSplats(folder / "no.ply", scene, SplatForm::kPly); },
                test::ThrowsSaying<CannotConvert>(why));
    EXPECT_FALSE(std::filesystem::exists(folder / "no.ply"));
  };
  expectRefusal(
      [](SplatScene& s) { s.densityScale = 2.3e30; },
      "grid \"smoke 1\" cannot become splats in a PLY file: its density scale is 2.3e+30");
  expectRefusal([](SplatScene& s) { s.densityScale = 1e-30; }, "its density scale is 1e-30");
  expectRefusal([](SplatScene& s) { s.toWorld[12] = 1e30; }, "matrix to the world is too large");
  expectRefusal(
      [](SplatScene& s) {
        for (double& m : s.toWorld) m = m == 1.0 ? m : m * 1e-30;
      },
      "matrix to the world is too small");
  expectRefusal([](SplatScene& s) { (*s.indexToWorld)[14] = -2e30; },
                "transform of the grid is too large");
  expectRefusal([](SplatScene& s) { s.splats.logScale[0][1] = 33.0f; },
                "1 of 2 splats have a number that is not finite, or a size");
  expectRefusal(
      [](SplatScene& s) {
        for (auto& size : s.splats.logScale) size[0] = -32.5f;
      },
      "1 of 2 splats");
  expectRefusal([](SplatScene& s) { s.splats.center[2][0] = std::nanf(""); }, "1 of 2 splats");
  SplatScene extreme = someScene();
  for (const double scale : {1.1e-30, 0.9e30}) {
    extreme.densityScale = scale;
    extreme.name.assign(100000, 'n');
    writeSplats(folder / "out.ply", extreme, SplatForm::kPly, true);
    EXPECT_EQ(readSplats(folder / "out.ply").scene.densityScale, scale);
  }
}

// USD.

/// A property of a prim: its declaration without a value ("uniform int degree"), its value, and its metadata.
struct UsdProperty {
  std::string declaration, value, metadata;

  /// All numbers of the value, in their order.
  [[nodiscard]] std::vector<double> numbers() const {
    std::string plain = value;
    std::ranges::replace_if(
        plain, [](char c) { return std::strchr("[](),", c) != nullptr; }, ' ');
    std::istringstream words(plain);
    return {std::istream_iterator<double>(words), {}};
  }
};

/// The properties of the only prim of a file, by their names.
std::map<std::string, UsdProperty> propertiesOf(const std::string& usda) {
  std::map<std::string, UsdProperty> all;
  std::istringstream lines(usda.substr(usda.find("\n{\n") + 3));
  for (std::string line; std::getline(lines, line) && line != "}";) {
    const auto equals = line.find(" = ");
    UsdProperty property{line.substr(4, equals - 4), line.substr(equals + 3), {}};
    if (property.value.ends_with("] (")) {
      property.value.resize(property.value.size() - 2);
      for (std::string entry; std::getline(lines, entry) && entry != "    )";)
        property.metadata += entry.substr(8) + ';';
    }
    const std::string name = property.declaration.substr(property.declaration.rfind(' ') + 1);
    EXPECT_TRUE(all.emplace(name, property).second) << name << " is there twice";
  }
  return all;
}

TEST(WriteSplats, HaveThePropertiesOfTheSchemaOfUsd) {
  const auto properties = propertiesOf(written(SplatForm::kUsd));
  std::vector<std::string> declarations;
  for (const auto& [name, property] : properties) declarations.push_back(property.declaration);
  EXPECT_THAT(declarations,
              testing::UnorderedElementsAre(
                  "point3f[] positions", "quatf[] orientations", "float3[] scales",
                  "float[] opacities", "float3[] radiance:sphericalHarmonicsCoefficients",
                  "uniform int radiance:sphericalHarmonicsDegree",
                  "uniform token projectionModeHint", "uniform token sortingModeHint",
                  "float3[] extent", "matrix4d xformOp:transform", "uniform token[] xformOpOrder"));
  const std::pair<const char*, std::size_t> perSplat[] = {
      {"positions", 3},
      {"orientations", 4},
      {"scales", 3},
      {"opacities", 1},
      {"radiance:sphericalHarmonicsCoefficients", 3}};
  for (const auto& [name, components] : perSplat)
    EXPECT_EQ(properties.at(name).numbers().size(), 2 * components) << name;
  EXPECT_EQ(properties.at("projectionModeHint").value, "\"perspective\"");
  EXPECT_EQ(properties.at("sortingModeHint").value, "\"zDepth\"");
  // (degree + 1)^2 coefficients a splat
  EXPECT_EQ(properties.at("radiance:sphericalHarmonicsDegree").value, "0");
  EXPECT_EQ(properties.at("radiance:sphericalHarmonicsCoefficients").metadata,
            "elementSize = 1;interpolation = \"vertex\";");
}

TEST(WriteSplats, GiveUsdLinearSizesAndOpacitiesAndQuaternionsWithTheirRealPartFirst) {
  const auto properties = propertiesOf(written(SplatForm::kUsd));
  const auto numbers = [&](const char* name) { return properties.at(name).numbers(); };
  const Splats splats = someScene().splats;
  for (std::size_t i = 0; i < splats.size(); ++i) {
    EXPECT_EQ(float(numbers("opacities")[i]), splats.alpha[i]);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(float(numbers("positions")[3 * i + c]), splats.center[c][i]);
      const double scale = std::exp(double(splats.logScale[c][i]));
      EXPECT_NEAR(numbers("scales")[3 * i + c], scale, 1e-6 * scale);
      const double harmonic = numbers("radiance:sphericalHarmonicsCoefficients")[3 * i + c];
      EXPECT_NEAR(0.5 + kConstantHarmonic * harmonic, splats.color[c][i], 1e-6);
    }
    for (std::size_t c = 0; c < 4; ++c)
      EXPECT_EQ(float(numbers("orientations")[4 * i + c]), splats.rotation[c][i]);
  }
}

TEST(WriteSplats, SayWhereSplatsOfUsdAre) {
  const std::string text = written(SplatForm::kUsd);
  const auto properties = propertiesOf(text);
  EXPECT_THAT(text, testing::StartsWith("#usda 1.0\n"));
  for (const char* part : {"defaultPrim = \"smoke_1\"", "metersPerUnit = 1\n", "upAxis = \"Z\"",
                           "def ParticleField3DGaussianSplat \"smoke_1\"\n{\n"})
    EXPECT_THAT(text, HasSubstr(part));
  const auto matrix = properties.at("xformOp:transform").numbers();  // for row vectors, as ours
  EXPECT_TRUE(std::ranges::equal(matrix, someScene().toWorld));
  EXPECT_EQ(properties.at("xformOpOrder").value, "[\"xformOp:transform\"]");
  // Three standard deviations of the largest size, e^-1, around (1.5, -2.25, 0) and (2.5, -2.25, 0).
  const double reach = 3 * std::exp(-1.0);
  const std::array<double, 6> box{1.5 - reach, -2.25 - reach, -reach,
                                  2.5 + reach, -2.25 + reach, reach};
  EXPECT_THAT(properties.at("extent").numbers(),
              testing::Pointwise(testing::DoubleNear(1e-6), box));
}

// Mitsuba 3.

/// Splats as Mitsuba's reader makes them.
struct MitsubaEllipsoids {
  std::vector<std::array<float, 3>> center, scale, harmonics;
  std::vector<std::array<float, 4>> quaternion;  ///< i, j, k, real
  std::vector<float> opacity;
};

/// Reads the header word by word; the places of properties count, not their names.
MitsubaEllipsoids readAsMitsuba(const std::string& ply) {
  std::vector<std::string> names, elements;
  std::size_t count = 0;
  std::istringstream header(ply.substr(0, ply.find("end_header\n")));
  for (std::string line; std::getline(header, line);) {
    std::istringstream words(line);
    std::string word, type, name, excess;
    words >> word;
    if (word == "comment") continue;
    if (word == "format") {
      EXPECT_EQ(line, "format binary_little_endian 1.0");
    } else if (word == "element") {
      words >> name >> count;
      elements.push_back(name);
    } else if (word == "property") {
      words >> type >> name;
      EXPECT_EQ(type, "float");  // rows are read as floats, whatever the type
      EXPECT_FALSE(words >> excess);
      names.push_back(name);
    } else {
      EXPECT_EQ(line, "ply");
    }
  }
  EXPECT_THAT(elements, testing::ElementsAre("vertex"));

  const std::size_t width = names.size();
  const auto at = [&](std::size_t begin, std::size_t n) {
    return std::vector(names.begin() + std::ptrdiff_t(begin),
                       names.begin() + std::ptrdiff_t(begin + n));
  };
  EXPECT_THAT(at(0, 6), testing::ElementsAre("x", "y", "z", "nx", "ny", "nz"));
  EXPECT_THAT(at(width - 7, 7), testing::ElementsAre("scale_0", "scale_1", "scale_2", "rot_0",
                                                     "rot_1", "rot_2", "rot_3"));
  EXPECT_EQ(names[6], "f_dc_0");           // with the next line, what makes them splats
  EXPECT_EQ(names[width - 8], "opacity");  // with harmonics
  EXPECT_EQ(width - 13 - 1, 3u);           // harmonics: those of degree 0

  MitsubaEllipsoids all;
  const std::size_t begin = ply.find("end_header\n") + 11;
  EXPECT_EQ(ply.size(), begin + count * width * sizeof(float));
  std::vector<float> row(width);
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(row.data(), ply.data() + begin + i * width * sizeof(float), width * sizeof(float));
    const float* scale = &row[width - 7];
    const float* rotation = &row[width - 4];
    all.center.push_back({row[0], row[1], row[2]});
    all.scale.push_back({std::exp(scale[0]), std::exp(scale[1]), std::exp(scale[2])});
    all.quaternion.push_back({rotation[1], rotation[2], rotation[3], rotation[0]});
    all.harmonics.push_back({row[6], row[7], row[8]});
    all.opacity.push_back(1.0f / (1.0f + std::exp(-row[width - 8])));
  }
  return all;
}

TEST(WriteSplats, AreWhatMitsubaReads) {
  const Splats splats = someScene().splats;
  const MitsubaEllipsoids back = readAsMitsuba(written(SplatForm::kMitsuba));
  ASSERT_EQ(back.center.size(), splats.size());
  for (std::size_t i = 0; i < splats.size(); ++i) {
    EXPECT_NEAR(back.opacity[i], splats.alpha[i], 1e-6);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(back.center[i][c], splats.center[c][i]);
      EXPECT_NEAR(back.scale[i][c], std::exp(splats.logScale[c][i]), 1e-6);
      EXPECT_EQ(back.quaternion[i][c], splats.rotation[c + 1][i]);
      // Its integrator of radiance fields adds the half, too.
      EXPECT_NEAR(0.5 + kConstantHarmonic * back.harmonics[i][c], splats.color[c][i], 1e-6);
    }
    EXPECT_EQ(back.quaternion[i][3], splats.rotation[0][i]);
  }
}

// ---- Reading

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
  EXPECT_EQ(
      file.whyDropped(),
      "6 with a number that is not finite, 1 with a quaternion of 0, 1 with a size above e^32");
  EXPECT_EQ(file.dropped(), 8u);
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
  expectRefusal(replaced("end_header", "element vertex 1\nproperty float x\nend_header"),
                "element vertex is there twice");
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
  expectRefusal(text.text(), "none of its splats can be used: 1 with a number that is not finite");
  text.rows.assign(50, usualRow());
  for (auto& row : text.rows) row[10] = row[13] = 0.0;
  text.rows[0] = usualRow();
  for (const std::size_t slot : {7u, 8u, 9u}) text.rows[0][slot] = -kInfinity;
  text.rows[1][6] = -kInfinity, text.rows[1][10] = 1.0;
  expectRefusal(text.text(),
                "none of its splats can be used: 48 with a quaternion of 0, 1 with a size of 0 or "
                "below e^-32, 1 with an opacity of 0");
  expectRefusal(replaced("comment made by a test",
                         "comment esvr_index_to_world 1 0 0 0 0 1 0 0 1 1 0 0 0 0 0 1"),
                "esvr_index_to_world is no transform of voxels");
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
