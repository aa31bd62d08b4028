// Measures the cases of docs/figures/stability.md on one device, and writes the figures as JSON:
//
//     bench_stability OUT.json [--device cpu|cuda|cuda:N] [--machine TEXT] [--iterations N] [--only TEXT]
//
// TEXT of --machine describes the machine on the page. --only measures the cases whose names contain
// TEXT. tests/bench/bench.py makes the page from these files.

#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bench/stability/stability.h"
#include "esvr/field.h"
#include "esvr/render.h"

namespace {

using namespace esvr;
using Json = nlohmann::ordered_json;

constexpr std::uint32_t kIterations = 400;

struct Options {
  std::string output, device = "cpu", machine, only;
  std::uint32_t iterations = kIterations;
};

Json finiteOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json evaluation(const Field& field, const Device& device) {
  StabilityOptions options;
  options.samples = 512;
  options.evaluate = [&](const Field& f, std::span<const Coord> corners, std::span<float> out) {
    evaluateBricksOn(device, f, corners, out);
  };
  options.arithmetic = arithmeticOf(device);
  const Stability s = measureStability(field, options);
  const Coord at = s.worst.front().at;
  return {{"max", finiteOrNull(s.largest)},
          {"rms", finiteOrNull(s.rms)},
          {"bound", s.bound},
          {"share_of_bound", finiteOrNull(s.shareOfBound)},
          {"peak", s.peak},
          {"digits", correctDigits(s.largest, s.peak)},
          {"at", {at.x, at.y, at.z}},
          {"overlap", s.largestOverlap},
          {"cancellation", s.meanCancellation},
          {"condition", s.extremes.largestCondition}};
}

Json gradients(const bench::StabilityCase& c, const Device& device) {
  const bench::GradientErrors errors = bench::measureGradients(*c.gradients, c.crowd, device);
  return {{"max", finiteOrNull(errors.largest)},
          {"bound", errors.bound},
          {"share_of_bound", finiteOrNull(errors.shareOfBound)}};
}

/// A number with few decimals, so that files are short. \param perUnit  a power of ten
double rounded(double value, double perUnit) { return std::round(value * perUnit) / perUnit; }

/// The curves that the page shows; those of the other factors are only needed at their ends.
Json curveOf(const bench::FitRun& run) {
  constexpr double kLargestFactor = 2.0;
  Json curve = Json::array();
  if (run.factor > kLargestFactor) return curve;
  for (const TimedCurvePoint& p : run.curve)
    curve.push_back({rounded(p.seconds, 1e5), rounded(p.psnrBox, 1e3)});
  return curve;
}

Json toJson(const bench::FitRun& run) {
  return {{"factor", run.factor},
          {"psnr", finiteOrNull(run.psnr)},
          {"max_error", finiteOrNull(run.largestError)},
          {"iterations", run.iterations},
          {"ellipsoids", run.ellipsoids},
          {"finite", run.finite},
          {"failure", run.failure},
          {"curve", curveOf(run)}};
}

Json fits(const bench::FitCase& c, const Device& device, std::uint32_t iterations) {
  const bench::FitFigures figures = bench::measureFits(c, device, iterations);
  Json runs = Json::array();
  for (const bench::FitRun& run : figures.runs) runs.push_back(toJson(run));
  return {{"active_voxels", figures.activeVoxels},
          {"psnr_of_nothing", finiteOrNull(figures.psnrOfNothing)},
          {"in_one_chunk", figures.inOneChunk ? toJson(*figures.inOneChunk) : Json(nullptr)},
          {"runs", std::move(runs)}};
}

Json measured(const bench::StabilityCase& c, const Device& device, const Options& options) {
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
  for (const bench::StabilityCase& c : bench::stabilityCases()) {
    if (c.name.find(options.only) == std::string::npos) continue;
    std::fprintf(stderr, "%s\n", c.name.c_str());
    out << std::exchange(separator, ",\n") << measured(c, device, options);
  }
  out << "\n]}\n";
  if (!out.flush()) throw std::runtime_error("cannot write " + options.output);
}

}  // namespace

int main(int argc, char** argv) try {
  run(parse({argv + 1, argv + argc}));
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "bench_stability: %s\n", error.what());
  return 1;
}
