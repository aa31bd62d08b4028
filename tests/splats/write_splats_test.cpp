// Plan: what is written is read back. The files for other programs are held against what these programs read:
//
// - The prim of a USD file has the properties of the schema ParticleField3DGaussianSplat with their types, and none
//   besides (pxr/usd/usdVol/schema.usda and usdGeom/schema.usda of OpenUSD 26.05). Arrays have one element a splat.
//   Numbers mean what the schema says: opacities and scales are linear, a quaternion begins with its real part, a
//   color is its coefficient of degree 0 times the constant harmonic, plus a half.
// - A PLY file for Mitsuba 3 is read by the steps of its reader (src/shapes/ellipsoids.h and ply.h of Mitsuba 3.9.1),
//   which finds properties by their places.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

#include "esvr/error.h"
#include "esvr/splats.h"
#include "support/temporary_folder.h"

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
  return test::contentOf(folder / "out");
}

TEST(WriteSplats, AreReadBackWithTheirPlaceInTheWorld) {
  const test::TemporaryFolder folder;
  const SplatScene scene = someScene();
  for (const SplatForm form : {SplatForm::kPly, SplatForm::kMitsuba}) {
    writeSplats(folder / "out.ply", scene, form, true);
    const SplatFile back = readSplats(folder / "out.ply");
    EXPECT_TRUE(back.hasPlacement);
    EXPECT_EQ(back.scene.toWorld, scene.toWorld);
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

}  // namespace
}  // namespace esvr
