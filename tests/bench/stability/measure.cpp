// Measures the cases of docs/figures/stability.md on one device, and writes the figures as JSON:
//
//     bench_stability OUT.json [--device cpu|cuda|cuda:N] [--machine TEXT] [--iterations N] [--only TEXT]
//
// TEXT of --machine describes the machine on the page. --only measures the cases whose names contain
// TEXT. tests/bench/bench.py makes the page from these files. Gradients are measured against differences in float64,
// and fits with step sizes around those of fit().

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/device_choice.h"
#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/fit.h"
#include "esvr/render.h"
#include "esvr/volume.h"
#include "fit/cpu/cpu_pass.h"
#include "fit/ellipsoid.h"
#include "fit/gradient_scene.h"
#include "fit/run.h"
#include "fit/volumes.h"
#include "support/stability.h"

#ifdef ESVR_WITH_CUDA
#include "core/cuda/runtime.h"
#include "fit/cuda/cuda_optimiser.h"
#endif

namespace esvr::bench {
namespace {

// The cases.

/// A fit of a volume.
struct FitCase {
  std::function<SparseVolume()> volume;
  std::size_t count = 0;           ///< ellipsoids
  std::optional<float> kappa{};    ///< of the kernel; nothing: it is fitted
  std::function<Field()> start{};  ///< ellipsoids to begin with; empty: seeds
  std::uint64_t chunkVoxels = 0;   ///< active voxels of a chunk; 0: one chunk
};

struct StabilityCase {
  std::string name;                               ///< of the row
  std::string detail;                             ///< what is measured, as sentences
  std::function<Field()> field{};                 ///< is evaluated; empty: not measured
  std::optional<test::GradientCase> gradients{};  ///< nothing: not measured
  std::optional<FitCase> fit{};                   ///< nothing: not measured
  /// Further ellipsoids at the same voxels, in the measurement of gradients.
  std::size_t crowd = 0;
};

using test::randomField;
using test::RandomFieldOptions;
using test::volumeOf;

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
                 return volumeOf({}, 6, 0.0f, [](Coord c) {
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
                 return volumeOf({}, 5, 0.0f, [](Coord c) {
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
                 return volumeOf({}, 4, 0.0f, [](Coord c) {
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
           FitCase{[] { return volumeOf({}, 3, 0.0f, [](Coord) { return 1.0f; }); }, 200}},
          {"a single voxel",
           "One voxel of the value 1.",
           {},
           std::nullopt,
           FitCase{[] {
                     return volumeOf({}, 1, 0.0f, [](Coord c) {
                       return c == Coord{3, 4, 5} ? 1.0f : 0.0f;
                     });
                   },
                   1}},
          {"a checkerboard",
           "A cube of 16^3 voxels, every other one of the value 1. It is the worst case of "
           "smooth primitives: only an ellipsoid for each voxel of value 1 is precise.",
           {},
           std::nullopt,
           FitCase{[] {
                     return volumeOf({}, 2, 0.0f,
                                     [](Coord c) { return float((c.x + c.y + c.z) & 1); });
                   },
                   512}}};
}

std::vector<StabilityCase> stabilityCases() {
  std::vector<StabilityCase> all;
  for (auto* part : {shapes, kernels, sharpnesses, magnitudes, places, values})
    for (StabilityCase& c : part()) all.push_back(std::move(c));
  return all;
}

// Gradients.

struct GradientErrors {
  /// Largest error of a derivative, divided by the sum of the magnitudes of the terms of the largest
  /// derivative of its ellipsoid.
  double largest = 0.0;
  double bound = 0.0;         ///< the largest that the arithmetic allows
  double shareOfBound = 0.0;  ///< largest error divided by its own bound
};

std::vector<EllipsoidGradient> gradientsOnCpu(const FitTarget& target, const Kernel& kernel,
                                              std::span<const Ellipsoid> ellipsoids) {
  constexpr double kSlack = 0.1;  // voxels
  CpuPass pass(target, kernelConstants<double>(kernel));
  pass.rebuild(ellipsoids, kSlack);
  std::vector<EllipsoidGradient> gradients(ellipsoids.size());
  pass.gradients(ellipsoids, gradients);
  return gradients;
}

/// The largest error of the derivatives of one ellipsoid; infinite if one is not finite.
double largestError(const EllipsoidGradient& found, const test::Differences& expected) {
  double largest = std::abs(found.byKappa - expected.by[kParameters]);
  for (int n = 0; n < kParameters; ++n) {
    const double error = std::abs(found.byParameter[std::size_t(n)] - expected.by[n]);
    if (!std::isfinite(error)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, error);
  }
  return std::isfinite(largest) ? largest : std::numeric_limits<double>::infinity();
}

/// The ellipsoids of a case, and others behind them.
std::vector<Ellipsoid> withCrowd(const test::GradientCase& c, const test::SmallTarget& target,
                                 std::size_t crowd) {
  std::vector<Ellipsoid> all = test::ellipsoidsOf(c, target);
  test::Random random(47);
  for (std::size_t n = 0; n < crowd; ++n) {
    Ellipsoid other = test::atAVoxel(c, random);
    other.intensity /= double(crowd);
    all.push_back(other);
  }
  return all;
}

#ifdef ESVR_WITH_CUDA
std::vector<EllipsoidGradient> gradientsOnGpu(const FitTarget& target, const Kernel& kernel,
                                              std::span<const Ellipsoid> ellipsoids,
                                              const Device& device) {
  cuda::useDevice(device);
  OptimiserOptions options;
  options.kernel = kernel;
  options.device = device;
  cuda::CudaOptimiser optimiser(target, options, {});
  optimiser.setEllipsoids(ellipsoids);
  return optimiser.gradients();
}
#else
std::vector<EllipsoidGradient> gradientsOnGpu(const FitTarget&, const Kernel&,
                                              std::span<const Ellipsoid>, const Device& device) {
  refuseCuda("gradients", device);
}
#endif

/// Measures the gradients of four ellipsoids.
/// \param crowd  ellipsoids of the same shapes that are added to the sum, as faint as they are many
GradientErrors measureGradients(const test::GradientCase& c, std::size_t crowd,
                                const Device& device) {
  const test::SmallTarget target;
  const auto ellipsoids = withCrowd(c, target, crowd);
  const auto residuals = test::residualsOf(target, c, ellipsoids);
  const Kernel kernel{.kappa = c.kappa};
  const auto gradients = device.kind == DeviceKind::kCuda
                             ? gradientsOnGpu(target.get(), kernel, ellipsoids, device)
                             : gradientsOnCpu(target.get(), kernel, ellipsoids);
  GradientErrors errors;
  for (std::size_t i = 0; i < ellipsoids.size() - crowd; ++i) {
    const test::Differences expected = test::differencesOf(target, c, ellipsoids[i], residuals);
    const double error = largestError(gradients[i], expected) / expected.magnitude;
    const double bound = test::toleranceOf(c, ellipsoids[i]);
    errors.largest = std::max(errors.largest, error);
    errors.bound = std::max(errors.bound, bound);
    errors.shareOfBound = std::max(errors.shareOfBound, error / bound);
  }
  return errors;
}

// Fits.

/// A fit whose step sizes are a multiple of the tuned ones.
struct FitRun {
  double factor = 1.0;
  double psnr = 0.0;          ///< dB over the box at the end
  double largestError = 0.0;  ///< as a share of the peak
  std::uint32_t iterations = 0;
  std::size_t ellipsoids = 0;
  bool finite = true;     ///< whether all parameters and errors are finite
  std::string failure{};  ///< why the fit ended early; empty if it did not
  std::vector<TimedCurvePoint> curve{};
};

struct FitFigures {
  std::uint64_t activeVoxels = 0;
  double psnrOfNothing = 0.0;          ///< dB, without an ellipsoid
  std::optional<FitRun> inOneChunk{};  ///< of a case in chunks: the same fit in one chunk
  std::vector<FitRun> runs;            ///< by increasing factors
};

/// The factors by which step sizes are multiplied: around 1, and beyond for the margin.
inline constexpr double kFactors[] = {0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0};

bool isFinite(const Ellipsoid& p) {
  const auto finite = [](double v) { return std::isfinite(v); };
  return std::ranges::all_of(p.center, finite) && std::ranges::all_of(p.L, finite) &&
         finite(p.intensity);
}

/// The fits of one volume.
class Fits {
 public:
  Fits(const FitCase& fitCase, const Device& device, std::uint32_t iterations)
      : case_(fitCase), volume_(fitCase.volume()) {
    options_.count = fitCase.count;
    options_.kappa = fitCase.kappa;
    options_.iterations = iterations;
    options_.device = device;
    target_ = makeTarget(volume_, std::nullopt);
    applyOptions(options_, target_);
  }

  [[nodiscard]] FitFigures measure() const {
    FitFigures figures;
    figures.activeVoxels = target_.activeVoxels;
    double squares = 0.0;
    for (const float v : target_.values) squares += double(v) * v;
    figures.psnrOfNothing = psnrOf(squares, target_.boxVoxels, target_.peak);
    if (case_.chunkVoxels > 0) {
      figures.runs.push_back(inChunks());
      figures.inOneChunk = withFactor(1.0);
    } else {
      for (const double factor : kFactors) figures.runs.push_back(withFactor(factor));
    }
    return figures;
  }

 private:
  [[nodiscard]] RunPlan plan(const Tuning& tuning) const {
    RunPlan plan;
    plan.count = case_.start ? case_.count : plannedCount(options_, target_.activeVoxels);
    plan.firstCount = firstSeeds(plan.count, tuning);
    if (case_.start) {
      plan.start = stateOf(importField(case_.start(), volume_.origin, target_.scale));
      plan.firstCount = plan.start.ellipsoids.size();
    }
    plan.iterations = *options_.iterations;
    plan.learnKappa = !options_.kappa;
    return plan;
  }

  [[nodiscard]] FitRun withFactor(double factor) const {
    Tuning tuning;
    tuning.steps = tuning.steps.scaled(factor);
    OptimiserOptions optimiserOptions;
    optimiserOptions.kernel.kappa = firstKappa(options_, tuning);
    optimiserOptions.device = options_.device;
    Recorder recorder(target_, options_);
    FitRun result{.factor = factor};
    const auto optimiser = makeOptimiser(target_, optimiserOptions, tuning);
    try {
      result.iterations = run(*optimiser, target_, recorder, plan(tuning), tuning).iterations;
      recorder.record(optimiser->measure(), optimiser->ellipsoidCount(), result.iterations);
    } catch (const RuntimeFailure& failure) {
      result.failure = failure.what();
    }
    result.curve = recorder.curve();
    const auto ellipsoids = optimiser->ellipsoids();
    result.ellipsoids = ellipsoids.size();
    result.finite = std::ranges::all_of(ellipsoids, isFinite);
    summarise(result);
    return result;
  }

  /// The fit in chunks, whose step sizes are those of fit().
  [[nodiscard]] FitRun inChunks() const {
    FitOptions options = options_;
    options.chunkVoxels = case_.chunkVoxels;
    const FitResult fitted = fit(volume_, options);
    FitRun result{.iterations = *options.iterations,
                  .ellipsoids = fitted.field.ellipsoidCount(),
                  .curve = fitted.curve};
    for (const Chunk& chunk : fitted.field.chunks) result.finite &= wellFormed(chunk.ellipsoids);
    summarise(result);
    return result;
  }

  /// Sets the errors to those of the last point, which are in the units of the volume.
  void summarise(FitRun& result) const {
    if (result.curve.empty()) return;
    const TimedCurvePoint& last = result.curve.back();
    result.psnr = last.psnrBox;
    result.largestError = last.maxError * target_.scale / target_.peak;
    result.finite = result.finite && std::isfinite(last.psnrBox) && std::isfinite(last.maxError);
  }

  const FitCase& case_;
  SparseVolume volume_;
  FitOptions options_;
  FitTarget target_;
};

// The program.

using Json = nlohmann::ordered_json;

constexpr std::uint32_t kIterations = 400;

struct Options {
  std::string output, device = "cpu", machine, only;
  std::uint32_t iterations = kIterations;
};

Json finiteOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// The number of leading decimal digits that a difference leaves correct: the largest whole d with difference <= 10^-d
/// peak, at most 17, which stands for no difference.
int correctDigits(double difference, double peak) {
  constexpr int kMost = std::numeric_limits<double>::max_digits10;
  if (difference == 0.0) return kMost;
  const double share = difference / peak;
  return share < 1.0 ? std::min(kMost, int(std::floor(-std::log10(share)))) : 0;
}

Json evaluation(const Field& field, const Device& device) {
  const test::Stability s = test::measureStability(field, {.samples = 512, .device = device});
  return {{"max", finiteOrNull(s.largest)},
          {"rms", finiteOrNull(s.rms)},
          {"bound", s.bound},
          {"share_of_bound", finiteOrNull(s.shareOfBound)},
          {"peak", s.peak},
          {"digits", correctDigits(s.largest, s.peak)},
          {"at", {s.at.x, s.at.y, s.at.z}},
          {"overlap", s.largestOverlap},
          {"cancellation", s.cancellation},
          {"condition", s.largestCondition}};
}

Json gradients(const StabilityCase& c, const Device& device) {
  const GradientErrors errors = measureGradients(*c.gradients, c.crowd, device);
  return {{"max", finiteOrNull(errors.largest)},
          {"bound", errors.bound},
          {"share_of_bound", finiteOrNull(errors.shareOfBound)}};
}

/// A number with few decimals, so that files are short. \param perUnit  a power of ten
double rounded(double value, double perUnit) { return std::round(value * perUnit) / perUnit; }

/// The curves that the page shows; those of the other factors are only needed at their ends.
Json curveOf(const FitRun& run) {
  constexpr double kLargestFactor = 2.0;
  Json curve = Json::array();
  if (run.factor > kLargestFactor) return curve;
  for (const TimedCurvePoint& p : run.curve)
    curve.push_back({rounded(p.seconds, 1e5), rounded(p.psnrBox, 1e3)});
  return curve;
}

Json toJson(const FitRun& run) {
  return {{"factor", run.factor},
          {"psnr", finiteOrNull(run.psnr)},
          {"max_error", finiteOrNull(run.largestError)},
          {"iterations", run.iterations},
          {"ellipsoids", run.ellipsoids},
          {"finite", run.finite},
          {"failure", run.failure},
          {"curve", curveOf(run)}};
}

Json fits(const FitCase& c, const Device& device, std::uint32_t iterations) {
  const FitFigures figures = Fits(c, device, iterations).measure();
  Json runs = Json::array();
  for (const FitRun& run : figures.runs) runs.push_back(toJson(run));
  return {{"active_voxels", figures.activeVoxels},
          {"psnr_of_nothing", finiteOrNull(figures.psnrOfNothing)},
          {"in_one_chunk", figures.inOneChunk ? toJson(*figures.inOneChunk) : Json(nullptr)},
          {"runs", std::move(runs)}};
}

Json measured(const StabilityCase& c, const Device& device, const Options& options) {
  return {{"name", c.name},
          {"detail", c.detail},
          {"evaluation", c.field ? evaluation(c.field(), device) : Json(nullptr)},
          {"gradients", c.gradients ? gradients(c, device) : Json(nullptr)},
          {"fit", c.fit ? fits(*c.fit, device, options.iterations) : Json(nullptr)}};
}

Options parse(const std::vector<std::string>& words) {
  Options options;
  for (std::size_t n = 0; n < words.size(); ++n) {
    if (!words[n].starts_with("--")) {
      options.output = words[n];
      continue;
    }
    const std::string value = n + 1 < words.size() ? words[n + 1] : "";
    if (words[n] == "--device")
      options.device = value;
    else if (words[n] == "--iterations")
      options.iterations = std::uint32_t(std::stoul(value));
    else if (words[n] == "--machine")
      options.machine = value;
    else if (words[n] == "--only")
      options.only = value;
    else
      throw std::invalid_argument("unknown option " + words[n]);
    ++n;
  }
  if (options.output.empty()) throw std::invalid_argument("no output file");
  return options;
}

void run(const Options& options) {
  const Device device = selectDevice(options.device);
  std::ofstream out(options.output);
  out << "{\"device\": " << Json(deviceName(device)) << ", \"machine\": " << Json(options.machine)
      << ", \"iterations\": " << options.iterations << ", \"cases\": [";
  const char* separator = "\n";
  for (const StabilityCase& c : stabilityCases()) {
    if (c.name.find(options.only) == std::string::npos) continue;
    std::fprintf(stderr, "%s\n", c.name.c_str());
    out << std::exchange(separator, ",\n") << measured(c, device, options);
  }
  out << "\n]}\n";
  if (!out.flush()) throw std::runtime_error("cannot write " + options.output);
}

}  // namespace
}  // namespace esvr::bench

int main(int argc, char** argv) try {
  esvr::bench::run(esvr::bench::parse({argv + 1, argv + argc}));
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "bench_stability: %s\n", error.what());
  return 1;
}
