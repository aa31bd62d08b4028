// Files of splats: PLY for viewers, PLY for Mitsuba 3, and text of USD.

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>

#include "core/atomic_file.h"
#include "core/counted.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/splats.h"
#include "splats/gaussian.h"

namespace esvr {
namespace {

using namespace splats;

static_assert(std::endian::native == std::endian::little,
              "rows of PLY files are written as they are");

/// The shortest text that reads as the same number.
template <class Real>
void addNumber(std::string& text, Real number) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  text.append(digits.data(), end);
}

/// The logarithm of the odds, in float64 up to the rounding of the result.
float logit(float alpha) { return float(std::log(double(alpha)) - std::log1p(-double(alpha))); }

float harmonicOf(float color) { return float((double(color) - kMiddleColor) / kFirstHarmonic); }

/// A name as a comment holds it: printable ASCII, in a line that readers of headers take.
std::string plainName(const std::string& name) {
  constexpr std::size_t kLongest = 1000;
  std::string plain;
  for (const char c : name.substr(0, kLongest)) plain += c >= ' ' && c <= '~' ? c : '?';
  return name.size() > kLongest ? plain + "..." : plain;
}

// PLY.

/// True if readSplats() leaves the splat out.
bool isFaulty(const Splats& splats, std::size_t i) {
  const auto isFinite = [&](const auto& arrays) {
    return std::ranges::all_of(
        arrays, [&](const auto& values) { return values.empty() || std::isfinite(values[i]); });
  };
  const float largest =
      std::max({splats.logScale[0][i], splats.logScale[1][i], splats.logScale[2][i]});
  return !(isFinite(splats.center) && isFinite(splats.logScale) && isFinite(splats.color) &&
           std::abs(largest) <= kMaxLogScale && splats.alpha[i] > 0.0f);
}

/// What readSplats() would not read as it is.
void requireReadable(const SplatScene& scene) {
  const auto refuse = [&](const std::string& why) {
    throw CannotConvert("grid \"" + shownName(scene.name) +
                        "\" cannot become splats in a PLY file: " + why);
  };
  if (!isUsualScale(scene.densityScale))
    refuse("its density scale is " + shortText(scene.densityScale) + ", and must be between " +
           shortText(kLeastNumber) + " and " + shortText(kMostNumber) +
           "; another one can be given (--density-scale)");
  if (const auto fault = faultOfToWorld(scene.toWorld); !fault.empty())
    refuse("the matrix to the world " + fault);
  if (scene.indexToWorld)
    if (const auto fault = faultOfLattice(*scene.indexToWorld); !fault.empty())
      refuse("the transform of the grid " + fault);
  std::size_t faulty = 0;
  for (std::size_t i = 0; i < scene.splats.size(); ++i) faulty += isFaulty(scene.splats, i);
  if (faulty > 0)
    refuse(std::to_string(faulty) + " of " + counted(scene.splats.size(), "splat") +
           " have a number that is not finite, or a size that is not between " +
           shortText(std::exp(-double(kMaxLogScale))) + " and " +
           shortText(std::exp(double(kMaxLogScale))));
}

std::string matrixComment(const char* word, const std::array<double, 16>& matrix) {
  std::string text = std::string("comment ") + word;
  for (const double entry : matrix) text += ' ', addNumber(text, entry);
  return text + '\n';
}

/// What the header says about the place of the splats in the world, which readSplats() reads.
std::string placementComments(const SplatScene& scene) {
  std::string text = matrixComment(kMatrixWord, scene.toWorld);
  if (scene.indexToWorld) text += matrixComment(kLatticeWord, *scene.indexToWorld);
  text += std::string("comment ") + kUpWord + (scene.up == UpAxis::kZ ? " z" : " y");
  text += std::string("\ncomment ") + kDensityWord + ' ';
  addNumber(text, scene.densityScale);
  return text + "\ncomment " + kGridWord + ' ' + plainName(scene.name) + '\n';
}

std::string plyHeader(const SplatScene& scene, bool hasNormals) {
  std::string text = "ply\nformat binary_little_endian 1.0\n" + placementComments(scene);
  text += "element vertex " + std::to_string(scene.splats.size()) + '\n';
  const auto addProperties = [&](std::initializer_list<const char*> names) {
    for (const char* name : names) text += std::string("property float ") + name + '\n';
  };
  addProperties({"x", "y", "z"});
  if (hasNormals) addProperties({"nx", "ny", "nz"});
  addProperties({"f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0",
                 "rot_1", "rot_2", "rot_3"});
  return text + "end_header\n";
}

/// Appends the numbers of a splat in the order of the header.
void addRow(const Splats& splats, std::size_t i, bool hasNormals, std::vector<float>& row) {
  for (const auto& c : splats.center) row.push_back(c[i]);
  if (hasNormals) row.insert(row.end(), 3, 0.0f);
  for (const auto& c : splats.color) row.push_back(c.empty() ? 0.0f : harmonicOf(c[i]));
  row.push_back(logit(splats.alpha[i]));
  for (const auto& s : splats.logScale) row.push_back(s[i]);
  for (const auto& q : splats.rotation) row.push_back(q[i]);
}

void writePly(AtomicFile& file, const SplatScene& scene, bool hasNormals) {
  constexpr std::size_t kRowsAtOnce = 65536;
  const std::string header = plyHeader(scene, hasNormals);
  file.write(std::as_bytes(std::span(header)));
  std::vector<float> rows;
  for (std::size_t begin = 0; begin < scene.splats.size(); begin += kRowsAtOnce) {
    throwIfCancelled();
    rows.clear();
    const std::size_t end = std::min(scene.splats.size(), begin + kRowsAtOnce);
    for (std::size_t i = begin; i < end; ++i) addRow(scene.splats, i, hasNormals, rows);
    file.write(std::as_bytes(std::span(rows)));
  }
}

// USD.

/// A name that a prim may have.
std::string primName(const std::string& name) {
  std::string prim;
  for (const char c : name) {
    const bool isLetter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    const bool isDigit = c >= '0' && c <= '9';
    if (isDigit && prim.empty()) prim = "_";
    prim += isLetter || isDigit ? c : '_';
  }
  return prim.empty() ? "splats" : prim;
}

/// The text of an array, which is written in pieces.
class UsdArrays {
 public:
  explicit UsdArrays(AtomicFile& file) : file_(file) {}

  /// \param number  returns a component of an element
  template <class Number>
  void write(const std::string& declaration, std::size_t count, std::size_t components,
             const Number& number, const char* metadata = "") {
    text_ += "    " + declaration + " = [";
    for (std::size_t i = 0; i < count; ++i) {
      if (i > 0) text_ += ", ";
      if (components > 1) text_ += '(';
      for (std::size_t c = 0; c < components; ++c) {
        if (c > 0) text_ += ", ";
        addNumber(text_, number(c, i));
      }
      if (components > 1) text_ += ')';
      if (text_.size() > kPiece) flush();
    }
    text_ += std::string("]") + metadata + '\n';
  }
  void write(const std::string& text) { text_ += text; }
  void flush() {
    throwIfCancelled();
    file_.write(std::as_bytes(std::span(text_)));
    text_.clear();
  }

 private:
  static constexpr std::size_t kPiece = std::size_t{1} << 20;
  AtomicFile& file_;
  std::string text_;
};

/// The corners of a box around all splats, to kExtent standard deviations.
std::array<std::array<float, 3>, 2> extentOf(const Splats& splats) {
  constexpr float kExtent = 3.0f, kInfinity = std::numeric_limits<float>::infinity();
  std::array<std::array<float, 3>, 2> extent{
      {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}}};
  for (std::size_t i = 0; i < splats.size(); ++i) {
    const float reach =
        kExtent *
        std::exp(std::max({splats.logScale[0][i], splats.logScale[1][i], splats.logScale[2][i]}));
    for (std::size_t a = 0; a < 3; ++a) {
      extent[0][a] = std::min(extent[0][a], splats.center[a][i] - reach);
      extent[1][a] = std::max(extent[1][a], splats.center[a][i] + reach);
    }
  }
  return extent;
}

std::string matrixText(const std::array<double, 16>& m) {
  std::string text = "(";
  for (std::size_t r = 0; r < 4; ++r) {
    text += r > 0 ? ", (" : " (";
    for (std::size_t c = 0; c < 4; ++c) {
      if (c > 0) text += ", ";
      addNumber(text, m[4 * r + c]);
    }
    text += ')';
  }
  return text + " )";
}

void writeUsd(AtomicFile& file, const SplatScene& scene) {
  const Splats& s = scene.splats;
  const std::string prim = primName(scene.name);
  UsdArrays out(file);
  out.write("#usda 1.0\n(\n    customLayerData = {\n        double esvr_density_scale = ");
  std::string number;
  addNumber(number, scene.densityScale);
  out.write(number + "\n    }\n    defaultPrim = \"" + prim +
            "\"\n    metersPerUnit = 1\n    upAxis = \"" + (scene.up == UpAxis::kZ ? "Z" : "Y") +
            "\"\n)\n\ndef ParticleField3DGaussianSplat \"" + prim + "\"\n{\n");
  const auto extent = extentOf(s);
  out.write("float3[] extent", 2, 3, [&](std::size_t c, std::size_t i) { return extent[i][c]; });
  out.write("float[] opacities", s.size(), 1,
            [&](std::size_t, std::size_t i) { return s.alpha[i]; });
  out.write("quatf[] orientations", s.size(), 4,
            [&](std::size_t c, std::size_t i) { return s.rotation[c][i]; });
  out.write("point3f[] positions", s.size(), 3,
            [&](std::size_t c, std::size_t i) { return s.center[c][i]; });
  out.write("    uniform token projectionModeHint = \"perspective\"\n");
  out.write(
      "float3[] radiance:sphericalHarmonicsCoefficients", s.size(), 3,
      [&](std::size_t c, std::size_t i) {
        return s.hasColors() ? harmonicOf(s.color[c][i]) : 0.0f;
      },
      " (\n        elementSize = 1\n        interpolation = \"vertex\"\n    )");
  out.write("    uniform int radiance:sphericalHarmonicsDegree = 0\n");
  out.write("float3[] scales", s.size(), 3,
            [&](std::size_t c, std::size_t i) { return std::exp(s.logScale[c][i]); });
  out.write("    uniform token sortingModeHint = \"zDepth\"\n    matrix4d xformOp:transform = " +
            matrixText(scene.toWorld) +
            "\n    uniform token[] xformOpOrder = [\"xformOp:transform\"]\n}\n");
  out.flush();
}

}  // namespace

void writeSplats(const std::filesystem::path& path, const SplatScene& scene, SplatForm form,
                 bool overwrite) {
  if (form != SplatForm::kUsd) requireReadable(scene);
  AtomicFile file(path, overwrite);
  if (form == SplatForm::kUsd)
    writeUsd(file, scene);
  else
    writePly(file, scene, form == SplatForm::kMitsuba);
  file.commit();
}

}  // namespace esvr
