#include "vdb2esvr/paper_options.h"

#include <cstdlib>
#include <limits>

#include "cli/choice.h"
#include "cli/number_list.h"
#include "cli/table.h"

namespace esvr::vdb2esvr {
namespace {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;

constexpr const char* kGroup = "With --preset paper (the paper's method, for comparison with it)";
constexpr std::int64_t kMaxEpochs = 10'000'000, kMaxSide = 1 << 20;
constexpr std::int64_t kMaxEllipsoids = std::numeric_limits<std::uint32_t>::max();
constexpr double kSmallestK = 0.5, kLargestK = 1e4;

/// A whole number within [low, high], or nothing.
std::optional<std::int64_t> whole(const Arguments& a, const std::string& option, std::int64_t low,
                                  std::int64_t high) {
  const auto given = a.find<std::int64_t>(option);
  if (given) cli::requireRange(option, *given, low, high);
  return given;
}

void readEllipsoid(const Arguments& a, PaperMethod& method) {
  method.gaussian = cli::choose<bool>("ellipsoid", a.get<std::string>("ellipsoid"),
                                      {{"ellipsoid", false}, {"gaussian", true}});
  const auto k = a.find<std::string>("sharpness");
  if (!k) return;
  if (method.gaussian) throw UsageError("Gaussians have no --sharpness");
  method.learnK = *k == "learned";
  if (method.learnK) return;
  char* end = nullptr;
  method.k = std::strtod(k->c_str(), &end);
  if (end == k->c_str() || *end != '\0')
    throw UsageError("--sharpness must be a number or 'learned', not '" + *k + "'");
  cli::requireRange("sharpness", method.k, kSmallestK, kLargestK);
}

void readDensify(const Arguments& a, PaperMethod& method) {
  method.densify = !a.get<bool>("no-densify");
  if (const auto threshold = a.find<double>("densify-threshold")) {
    cli::requireRange("densify-threshold", *threshold, 0.0, std::numeric_limits<double>::max());
    method.gradientThreshold = *threshold;
  }
  if (const auto percent = a.find<double>("percent-dense")) {
    cli::requireRange("percent-dense", *percent, 1e-9, 1.0);
    method.percentDense = *percent;
  }
  if (const auto n = whole(a, "densify-from", 1, kMaxEpochs))
    method.densifyFrom = std::uint32_t(*n);
  if (const auto n = whole(a, "densify-until", 1, kMaxEpochs))
    method.densifyUntil = std::uint32_t(*n);
  if (const auto n = whole(a, "densify-every", 1, kMaxEpochs))
    method.densifyEvery = std::uint32_t(*n);
}

/// Position, scale, rotation and intensity.
void readRates(const Arguments& a, PaperRates& rates) {
  const auto given = a.find<std::string>("rates");
  if (!given) return;
  const auto numbers = cli::parseNumbers("rates", *given, 4);
  for (const double rate : numbers)
    cli::requireRange("rates", rate, 0.0, std::numeric_limits<double>::max());
  rates.position = numbers[0];
  rates.scale = numbers[1];
  rates.rotation = numbers[2];
  rates.intensity = numbers[3];
}

void readPrune(const Arguments& a, PaperMethod& method) {
  const auto passes = a.get<std::string>("prune-passes");
  if (passes == "3")
    method = withThreePasses(method);
  else if (passes == "0")
    method.prunes.clear();
  else if (passes != "1")
    throw UsageError("--prune-passes must be 0, 1 or 3, not '" + passes + "'");
  method.score = cli::choose<PruneScore>("prune-score", a.get<std::string>("prune-score"),
                                         {{"full", PruneScore::kFull},
                                          {"no-fa", PruneScore::kWithoutFa},
                                          {"only-fa", PruneScore::kOnlyFa},
                                          {"contribution", PruneScore::kContribution}});
  if (const auto share = a.find<double>("prune-share")) {
    cli::requireRange("prune-share", *share, 0.0, 0.999999);
    for (PrunePass& pass : method.prunes) pass.share = *share;
  }
}

PaperMethod readMethod(const Arguments& a) {
  PaperMethod method;
  readEllipsoid(a, method);
  readPrune(a, method);
  if (const auto epochs = whole(a, "epochs", 1, kMaxEpochs))
    method = scaledTo(method, std::uint32_t(*epochs));
  readDensify(a, method);
  readRates(a, method.rates);
  if (const auto n = whole(a, "points", 1, kMaxEllipsoids)) method.points = std::size_t(*n);
  if (const auto n = whole(a, "most", 1, kMaxEllipsoids)) method.maxEllipsoids = std::size_t(*n);
  if (const auto n = whole(a, "subvolume", 1, kMaxSide)) method.subvolume = int(*n);
  method.countHits = a.get<bool>("hits");
  return method;
}

/// --preset paper's options that were given, in words.
std::string givenWithout(const Arguments& a) {
  const auto group = paperOptions();
  for (const auto& option : group.options()) {
    const auto& given = a.values[option->long_name()];
    if (!given.empty() && !given.defaulted()) return option->long_name();
  }
  return {};
}

std::string ratesText(const PaperRates& rates) {
  std::string text;
  for (const double rate : {rates.position, rates.scale, rates.rotation, rates.intensity})
    text += (text.empty() ? "" : ",") + cli::shortNumber(rate);
  return text;
}

}  // namespace

cli::po::options_description paperOptions() {
  const PaperMethod m;
  cli::po::options_description group(kGroup);
  // clang-format off
  group.add_options()
    ("epochs", value<std::int64_t>()->value_name("N"),
     ("rounds through all subvolumes (default: " + std::to_string(m.epochs) +
      "); what follows in epochs is scaled with it").c_str())
    ("points", value<std::int64_t>()->value_name("N"),
     ("ellipsoids at the start (default: " + std::to_string(m.points) + ")").c_str())
    ("subvolume", value<std::int64_t>()->value_name("VOXELS"),
     "side of the cubes fitted in turn (default: half the longest axis, or the shortest)")
    ("ellipsoid", value<std::string>()->value_name("P")->default_value("ellipsoid"),
     "ellipsoid, or gaussian (3 sigma)")
    ("sharpness", value<std::string>()->value_name("K"),
     ("k of the ellipsoids, or 'learned' for each (default: " + cli::shortNumber(m.k) +
      ")").c_str())
    ("rates", value<std::string>()->value_name("P,S,R,I"),
     ("first learning rates of position, scale, rotation, intensity (default: " +
      ratesText(m.rates) + "), which end at a tenth").c_str())
    ("no-densify", bool_switch(), "neither clone nor split")
    ("densify-threshold", value<double>()->value_name("G"),
     ("gradient by position from which they do (default: " +
      cli::shortNumber(m.gradientThreshold) + ")").c_str())
    ("percent-dense", value<double>()->value_name("S"),
     ("larger scales are split, smaller cloned, of half the longest axis (default: " +
      cli::shortNumber(m.percentDense) + ")").c_str())
    ("densify-from", value<std::int64_t>()->value_name("EPOCH"), "after a warm-up of so many")
    ("densify-until", value<std::int64_t>()->value_name("EPOCH"), "the last time")
    ("densify-every", value<std::int64_t>()->value_name("EPOCHS"), "interval")
    ("most", value<std::int64_t>()->value_name("N"), "ellipsoids at which cloning and splitting end")
    ("prune-passes", value<std::string>()->value_name("N")->default_value("1"),
     "0, 1, or 3 (the paper's schedule for BigBrain); --count is what the last one leaves")
    ("prune-score", value<std::string>()->value_name("S")->default_value("full"),
     "full (coverage * intensity * FA), no-fa, only-fa, contribution (as LightGaussian)")
    ("prune-share", value<double>()->value_name("S"), "of the ellipsoids, removed by each pass");
  // clang-format on
  return group;
}

std::optional<PaperMethod> paperMethod(const Arguments& a) {
  if (a.get<std::string>("preset") == "paper") {
    if (!a.values["loss"].defaulted() && a.get<std::string>("loss") != "paper")
      throw UsageError("--preset paper has the paper's loss; give --beta 1 for L1 alone");
    return readMethod(a);
  }
  if (const std::string option = givenWithout(a); !option.empty())
    throw UsageError("--" + option + " goes with --preset paper only");
  return std::nullopt;
}

}  // namespace esvr::vdb2esvr
