#include "bench/stability/stability.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "esvr/field.h"

namespace esvr::bench {
namespace {

using test::randomField;
using test::RandomFieldOptions;

/// The value of a voxel.
using ValueAt = std::function<float(Coord)>;

/// A cube of bricks whose voxels are active where they differ from the background, 0.
SparseVolume cubeOf(int bricks, const ValueAt& valueAt, Coord corner = {}) {
  std::vector<BrickInput> inputs;
  for (int n = 0; n < bricks * bricks * bricks; ++n) {
    BrickInput brick{
        .corner =
            corner + Coord{n / (bricks * bricks), n / bricks % bricks, n % bricks} * kBrickSide,
        .values = {},
        .active = {}};
    for (int v = 0; v < kBrickVoxels; ++v) {
      const float value = valueAt(brick.corner - corner + voxelLocal(v));
      brick.values[std::size_t(v)] = value;
      if (value != 0.0f) brick.active.set(v);
    }
    inputs.push_back(brick);
  }
  return makeVolume(std::move(inputs), 0.0f);
}

/// The voxels of a field.
std::function<SparseVolume()> voxelsOf(std::function<Field()> field, float threshold = 1e-4f) {
  return [field = std::move(field), threshold] {
    return revoxelise(field(), {.threshold = threshold});
  };
}

struct Shape {
  std::array<double, 3> scales;
  std::array<float, 4> rotation{1.0f, 0.0f, 0.0f, 0.0f};
};

/// One ellipsoid of intensity 1 with this center in all coordinates.
Field fieldOfOne(const Shape& shape, float center, float kappa = 2.0f) {
  Field field = randomField({.count = 1, .kappa = kappa});
  Ellipsoids& e = field.chunks[0].ellipsoids;
  for (std::size_t a = 0; a < 3; ++a) {
    e.center[a][0] = center;
    e.logScale[a][0] = float(std::log(shape.scales[a]));
  }
  for (std::size_t a = 0; a < 4; ++a) e.rotation[a][0] = shape.rotation[a];
  e.intensity[0] = 1.0f;
  return field;
}

/// A field whose ellipsoids all have these scales.
Field withScales(Field field, const std::array<double, 3>& scales) {
  for (Chunk& chunk : field.chunks)
    for (std::size_t a = 0; a < 3; ++a)
      std::ranges::fill(chunk.ellipsoids.logScale[a], float(std::log(scales[a])));
  return field;
}

/// The rotation from x to the diagonal of a cube.
std::array<float, 4> towardsDiagonal() {
  const double angle = std::acos(1.0 / std::sqrt(3.0)), s = std::sin(angle / 2.0) / std::sqrt(2.0);
  return {float(std::cos(angle / 2.0)), 0.0f, float(-s), float(s)};
}

/// Ellipsoids of ordinary shapes with random intensities of one sign or both.
RandomFieldOptions usual(float kappa = 2.0f) {
  return {.count = 60, .extent = 40.0, .smallest = 1.5, .kappa = kappa};
}

std::vector<StabilityCase> shapes() {
  const std::array<double, 3> needle{100.0, 0.1, 0.1}, disc{100.0, 100.0, 0.1};
  return {
      {"needles 1:1000",
       "Scales of 100, 0.1 and 0.1 voxels in random directions. The fit is of a needle along the "
       "diagonal with scales of 300, 0.3 and 0.3 voxels.",
       [=] { return withScales(randomField({.count = 30, .extent = 24.0}), needle); },
       test::GradientCase{"needle", {100.0, 0.1, 0.1}, 2.0f},
       FitCase{voxelsOf([] {
                 return fieldOfOne({{300.0, 0.3, 0.3}, towardsDiagonal()}, 0.0f);
               }),
               600}},
      {"discs 1:1000",
       "Scales of 100, 100 and 0.1 voxels in random directions. The fit is of one layer of "
       "voxels: a disc with scales of 50, 50 and 0.05 voxels in the plane of an axis.",
       [=] { return withScales(randomField({.count = 30, .extent = 24.0}), disc); },
       test::GradientCase{"pancake", {100.0, 100.0, 0.1}, 2.0f},
       FitCase{voxelsOf([] {
                 return fieldOfOne({{50.0, 50.0, 0.05}}, 0.0f);
               }),
               600}},
      {"scales of 0.1 voxels",
       "Spheres with a scale of 0.1 voxels, whose support is smaller than a voxel. The fit is of "
       "216 single voxels far from each other.",
       [] {
         return withScales(randomField({.count = 4000, .extent = 24.0}), {0.1, 0.1, 0.1});
       },
       test::GradientCase{"subvoxel", {0.1, 0.1, 0.1}, 2.0f},
       FitCase{[] {
                 return cubeOf(6, [](Coord c) {
                   return c.x % 8 == 3 && c.y % 8 == 3 && c.z % 8 == 3 ? 1.0f : 0.0f;
                 });
               },
               216}},
      {"scales of 300 voxels",
       "Spheres with a scale of 300 voxels. The fit is of a cube of 40^3 voxels on the flank of "
       "one, which ends sharply at its sides.",
       [] {
         return withScales(randomField({.count = 20, .extent = 40.0}), {300.0, 300.0, 300.0});
       },
       test::GradientCase{"vast", {300.0, 300.0, 300.0}, 2.0f},
       FitCase{[] {
                 return cubeOf(5, [](Coord c) {
                   const double m = (std::pow(c.x + 400.0, 2) + c.y * c.y + c.z * c.z) / 9e4;
                   return float(std::exp(-m));
                 });
               },
               300}}};
}

std::vector<StabilityCase> kernels() {
  std::vector<StabilityCase> cases;
  for (const float kappa : {-30.0f, -3.0f, 0.0f, 5.0f, 30.0f}) {
    const auto field = [kappa] { return randomField(usual(kappa)); };
    cases.push_back(
        {"kappa " + std::to_string(int(kappa)),
         "Ordinary shapes with this edge. The fit keeps the edge, and is of the voxels of the "
         "same ellipsoids.",
         field, test::GradientCase{"usual", {2.0, 1.0, 0.6}, kappa},
         FitCase{voxelsOf(field), 300, kappa}});
  }
  return cases;
}

std::vector<StabilityCase> sharpnesses() {
  std::vector<StabilityCase> cases;
  for (const float k : {0.5f, 5.0f, 50.0f, 500.0f, 5000.0f}) {
    // The paper's scales are sqrt(k) times ours, so that the ellipsoids are as large for any k.
    const double s = 1.0 / std::sqrt(double(k));
    const auto field = [=] {
      Field paper = withScales(randomField(usual(k)), {6.0 * s, 4.0 * s, 3.0 * s});
      paper.kernel.form = KernelForm::kPaper;
      return paper;
    };
    cases.push_back({"k = " + (k < 1.0f ? std::string("0.5") : std::to_string(int(k))),
                     "The paper's kernel of this sharpness with its scales of 6, 4 and 3 voxels. "
                     "Gradients and fit are those of the continuous kernel with the same edge, "
                     "and the fit is of a smooth volume.",
                     field, test::GradientCase{"paper", {6.0 * s, 4.0 * s, 3.0 * s}, k},
                     FitCase{voxelsOf([] { return randomField(usual()); }), 300, k}});
  }
  return cases;
}

std::vector<StabilityCase> magnitudes() {
  std::vector<StabilityCase> cases;
  for (const auto& [name, factor] : {std::pair{"1e-30", 1e-30}, {"1e30", 1e30}}) {
    const auto field = [factor = factor] {
      RandomFieldOptions o = usual();
      o.intensity = factor;
      return randomField(o);
    };
    cases.push_back(
        {std::string("intensities of ") + name,
         "Ordinary shapes with intensities of this magnitude. A fit scales its target by a power "
         "of two, so gradients are those of any other magnitude.",
         field, std::nullopt, FitCase{voxelsOf(field, float(1e-4 * factor)), 300}});
  }
  const auto denormal = [] {
    RandomFieldOptions o = usual();
    o.intensity = 1e-40;
    return randomField(o);
  };
  cases.push_back(
      {"denormals",
       "Intensities of 1e-40, below the normal numbers of float32. The peak has 16 bits, so that "
       "the precision of a value is 1.4e-5 of the peak.",
       denormal, std::nullopt, FitCase{voxelsOf(denormal, 0.0f), 300}});
  const auto cancelling = [] {
    Field field = randomField(usual());
    Ellipsoids& e = field.chunks[0].ellipsoids;
    Ellipsoids twice = e;
    twice.resize(2 * e.size());
    const auto copy = [&](auto& from, auto& to, float factor) {
      std::ranges::copy(from, to.begin());
      std::ranges::transform(from, to.begin() + std::ptrdiff_t(from.size()),
                             [&](float value) { return factor * value; });
    };
    for (std::size_t a = 0; a < 3; ++a) {
      copy(e.center[a], twice.center[a], 1.0f);
      copy(e.logScale[a], twice.logScale[a], 1.0f);
    }
    for (std::size_t a = 0; a < 4; ++a) copy(e.rotation[a], twice.rotation[a], 1.0f);
    copy(e.intensity, twice.intensity, -0.999f);
    field.chunks[0].ellipsoids = twice;
    return field;
  };
  cases.push_back(
      {"signed data that cancel",
       "Pairs of ellipsoids of both signs whose sum is a thousandth of each. Gradients and "
       "fit are of signed data: ordinary shapes of both signs.",
       cancelling, test::GradientCase{"usual", {2.0, 1.0, 0.6}, 2.0f},
       FitCase{voxelsOf([] { return randomField(usual()); }), 300}});
  return cases;
}

/// Ten thousand ellipsoids of both signs within one voxel.
Field crowd() {
  return randomField({.count = 10000, .extent = 1.0, .smallest = 1.0, .intensity = 0.01});
}

std::vector<StabilityCase> places() {
  std::vector<StabilityCase> cases{
      {"ten thousand over one voxel",
       "10,000 ellipsoids of both signs whose centers lie within one voxel. Gradients are those of "
       "four ellipsoids among 10,000 in 16^3 voxels. The fit begins with the ellipsoids over one "
       "voxel, and is of a ball with a radius of 12 voxels.",
       crowd, test::GradientCase{"usual", {2.0, 1.0, 0.6}, 2.0f},
       FitCase{[] {
                 return cubeOf(4, [](Coord c) {
                   const double r = std::hypot(c.x - 15.0, c.y - 15.0, c.z - 15.0);
                   return float(std::max(0.0, 1.0 - r * r / 144.0));
                 });
               },
               10000, 2.0f,
               [] {
                 Field field = crowd();
                 for (auto& center : field.chunks[0].ellipsoids.center)
                   for (float& c : center) c += 15.0f;
                 return field;
               }}},
      {"coordinates of +-1e7",
       "Ordinary shapes ten million voxels from the origin, on both sides. Centers are relative "
       "to a chunk, and a fit is relative to the volume, so gradients are those of any other "
       "place.",
       [] {
         RandomFieldOptions o = usual();
         o.origin = {10'000'000, -10'000'000, 10'000'000};
         return randomField(o);
       },
       std::nullopt,
       FitCase{voxelsOf([] {
                 RandomFieldOptions o = usual();
                 o.origin = {10'000'000, -10'000'000, 10'000'000};
                 return randomField(o);
               }),
               300}},
      {"chunk seams",
       "Ellipsoids on both sides of a border of chunks of coordinates (4096 voxels), to which "
       "their centers are relative. The fit is in chunks of 20,000 voxels, whose borders cut the "
       "ellipsoids.",
       [] {
         RandomFieldOptions o = usual();
         o.origin = {-20, 0, 0};
         Field field = randomField(o);
         o.origin = {kChunkExtent - 20, 0, 0};
         o.seed = 11;
         // Centers near 4096 in the first chunk meet those near 0 in the second one.
         for (float& x : field.chunks[0].ellipsoids.center[0]) x += float(kChunkExtent);
         field.chunks.push_back(randomField(o).chunks[0]);
         return field;
       },
       std::nullopt, FitCase{voxelsOf([] { return randomField(usual()); }), 300, {}, {}, 20000}}};
  cases.front().crowd = 10000;
  return cases;
}

std::vector<StabilityCase> values() {
  return {{"a constant",
           "A cube of 24^3 voxels of the value 1.",
           {},
           std::nullopt,
           FitCase{[] { return cubeOf(3, [](Coord) { return 1.0f; }); }, 200}},
          {"a single voxel",
           "One voxel of the value 1.",
           {},
           std::nullopt,
           FitCase{[] {
                     return cubeOf(1, [](Coord c) { return c == Coord{3, 4, 5} ? 1.0f : 0.0f; });
                   },
                   1}},
          {"a checkerboard",
           "A cube of 16^3 voxels, every other one of the value 1. It is the worst case of "
           "smooth primitives: only an ellipsoid for each voxel of value 1 is precise.",
           {},
           std::nullopt,
           FitCase{[] { return cubeOf(2, [](Coord c) { return float((c.x + c.y + c.z) & 1); }); },
                   512}}};
}

}  // namespace

std::vector<StabilityCase> stabilityCases() {
  std::vector<StabilityCase> all;
  for (auto* part : {shapes, kernels, sharpnesses, magnitudes, places, values})
    for (StabilityCase& c : part()) all.push_back(std::move(c));
  return all;
}

}  // namespace esvr::bench
