// The option --paper, which replaces our method by the paper's, and its part of the report.

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "esvr/did_you_mean.h"
#include "esvr/error.h"
#include "programs/option_values.h"
#include "programs/run_main.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/records.h"

namespace esvr::vdb2esvr {

// Settings.

namespace {

constexpr std::int64_t kMaxEpochs = 10'000'000, kMaxSide = 1 << 20;
constexpr double kMinK = 0.5, kMaxK = 1e4, kMaxNumber = 1e30;
constexpr const char* kDefault = "default";

/// A given setting.
struct Setting {
  std::string key, value;

  [[noreturn]] void refuse(const std::string& wanted) const {
    throw UsageError("--paper: " + key + " must be " + wanted + ", not '" + value + "'");
  }
  [[nodiscard]] double number(double low, double high) const {
    const auto given = cli::parseNumber(value);
    if (!given || *given < low || *given > high)
      refuse("a number from " + cli::shortNumber(low) + " to " + cli::shortNumber(high));
    return *given;
  }
  [[nodiscard]] std::int64_t whole(std::int64_t high) const {
    const auto given = cli::parseWhole(value);
    if (!given || *given < 1 || *given > high)
      refuse("a whole number from 1 to " + std::to_string(high));
    return *given;
  }
  [[nodiscard]] std::uint32_t epochs() const { return std::uint32_t(whole(kMaxEpochs)); }
};

/// Reads four rates that are separated by colons: position, scale, rotation, intensity.
void readRates(const Setting& setting, PaperMethod& method) {
  constexpr std::size_t kRates = 4;
  std::vector<double> rates;
  const auto parts = cli::splitText(setting.value, ':');
  for (const auto& part : parts)
    if (const auto rate = cli::parseNumber(part); rate && *rate >= 0.0) rates.push_back(*rate);
  if (parts.size() != kRates || rates.size() != kRates)
    setting.refuse("four rates of 0 or above, for example 2e-4:5e-3:1e-3:1e-2");
  method.rates.position = rates[0], method.rates.scale = rates[1];
  method.rates.rotation = rates[2], method.rates.intensity = rates[3];
}

void readK(const Setting& setting, PaperMethod& method) {
  method.learnK = setting.value == "learned";
  if (!method.learnK) method.k = setting.number(kMinK, kMaxK);
}

void readPasses(const Setting& setting, PaperMethod& method) {
  if (setting.value == "3")
    method = withThreePasses(method);
  else if (setting.value == "0")
    method.prunes.clear();
  else if (setting.value != "1")
    setting.refuse("0, 1 or 3");
}

/// \throws UsageError  the value is none of the choices
template <class T>
T choiceIn(const Setting& setting, std::initializer_list<cli::Choice<T>> choices) {
  return cli::choose<T>("paper " + setting.key, setting.value, choices);
}

constexpr std::initializer_list<cli::Choice<PruneScore>> kScores{
    {"full", PruneScore::kFull},
    {"no-fa", PruneScore::kWithoutFa},
    {"only-fa", PruneScore::kOnlyFa},
    {"contribution", PruneScore::kContribution},
    {"rays", PruneScore::kRays}};

std::string ratesText(const PaperRates& rates) {
  std::string text;
  for (const double rate : {rates.position, rates.scale, rates.rotation, rates.intensity})
    text += (text.empty() ? "" : ":") + cli::shortNumber(rate);
  return text;
}

struct Key {
  const char* name;
  std::string value;  ///< default value as a text; empty: it follows from the volume
  const char* help;
  std::function<void(const Setting&, PaperMethod&)> read;
};

std::string text(double number) { return cli::shortNumber(number); }

std::vector<Key> methodKeys(const PaperMethod& m) {
  return {
      {"prunes", "1", "pruning passes: 0, 1, or 3 (the paper's schedule for BigBrain)", readPasses},
      {"epochs", std::to_string(m.epochs),
       "number of epochs; an epoch visits every subvolume once. Settings that are given\n"
       "in epochs are scaled with it",
       [](const Setting& s, PaperMethod& p) { p = scaledTo(p, s.epochs()); }},
      {"kernel", "ellipsoid", "ellipsoid, or gaussian (Gaussians that end at 3 sigma)",
       [](const Setting& s, PaperMethod& p) {
         p.gaussian = choiceIn<bool>(s, {{"ellipsoid", false}, {"gaussian", true}});
       }},
      {"k", text(m.k), "sharpness of the ellipsoids, or 'learned' for each one", readK},
      {"beta", text(m.beta), "share of L1 in the loss; the rest is D-SSIM",
       [](const Setting& s, PaperMethod& p) { p.beta = s.number(0.0, 1.0); }},
      {"points", std::to_string(m.points), "number of ellipsoids at the start",
       [](const Setting& s, PaperMethod& p) { p.points = std::size_t(s.whole(kMaxEllipsoids)); }},
      {"max", std::to_string(m.maxEllipsoids),
       "number of ellipsoids at which cloning and splitting end",
       [](const Setting& s, PaperMethod& p) {
         p.maxEllipsoids = std::size_t(s.whole(kMaxEllipsoids));
       }},
      {"subvolume", "",
       "side of the subvolumes in voxels (default: half the longest axis, or the\n"
       "shortest axis if that is less)",
       [](const Setting& s, PaperMethod& p) { p.subvolume = int(s.whole(kMaxSide)); }},
      {"rates", ratesText(m.rates),
       "learning rates of position, scale, rotation and intensity at the start; all\n"
       "decay to a tenth",
       readRates},
  };
}

std::vector<Key> densifyKeys(const PaperMethod& m) {
  return {
      {"densify", "on", "densification: on, or off (ellipsoids are neither cloned nor split)",
       [](const Setting& s, PaperMethod& p) {
         p.densify = choiceIn<bool>(s, {{"on", true}, {"off", false}});
       }},
      {"densify-from", std::to_string(m.densifyFrom), "epoch of the first densification",
       [](const Setting& s, PaperMethod& p) { p.densifyFrom = s.epochs(); }},
      {"densify-until", std::to_string(m.densifyUntil), "last epoch of densification",
       [](const Setting& s, PaperMethod& p) { p.densifyUntil = s.epochs(); }},
      {"densify-every", std::to_string(m.densifyEvery), "epochs between densifications",
       [](const Setting& s, PaperMethod& p) { p.densifyEvery = s.epochs(); }},
      {"densify-threshold", text(m.gradientThreshold),
       "length of the gradient by position above which an ellipsoid is cloned or split",
       [](const Setting& s, PaperMethod& p) { p.gradientThreshold = s.number(0.0, kMaxNumber); }},
      {"percent-dense", text(m.percentDense),
       "scale, as a share of half the longest axis, above which ellipsoids are split\n"
       "instead of cloned",
       [](const Setting& s, PaperMethod& p) { p.percentDense = s.number(1e-9, 1.0); }},
  };
}

std::vector<Key> pruneKeys(const PaperMethod& m) {
  return {
      {"prune-score", "full",
       "full (coverage * intensity * FA), no-fa, only-fa, contribution (sum of values), or\n"
       "rays (the score of LightGaussian: light and opacity over the rays of 360 views)",
       [](const Setting& s, PaperMethod& p) { p.score = choiceIn(s, kScores); }},
      {"prune-share", text(m.prunes.front().share), "share of the ellipsoids that a pass removes",
       [](const Setting& s, PaperMethod& p) {
         for (PrunePass& pass : p.prunes) pass.share = s.number(0.0, 0.999999);
       }},
  };
}

/// The keys in the order in which they are applied. Keys that set a whole schedule come before
/// those that change a part of it.
std::vector<Key> keys() {
  const PaperMethod m;
  std::vector<Key> all = methodKeys(m);
  for (const auto& more : {densifyKeys(m), pruneKeys(m)})
    all.insert(all.end(), more.begin(), more.end());
  return all;
}

/// Reads KEY=VALUE.
Setting settingOf(const std::string& item) {
  const std::size_t sign = item.find('=');
  if (sign == std::string::npos)
    throw UsageError("--paper takes KEY=VALUE[,KEY=VALUE...] or default, not '" + item +
                     "'; see --help paper");
  return {item.substr(0, sign), item.substr(sign + 1)};
}

std::map<std::string, Setting> settingsIn(const std::vector<std::string>& given) {
  std::map<std::string, Setting> settings;
  for (const std::string& text : given) {
    if (text == kDefault) continue;
    for (const std::string& item : cli::splitText(text, ',')) {
      const Setting setting = settingOf(item);
      if (!settings.emplace(setting.key, setting).second)
        throw UsageError("--paper: " + setting.key + " is given twice");
    }
  }
  return settings;
}

/// Indents the lines of a description.
std::string indented(const std::string& text) {
  std::string result;
  for (const char c : text)
    result += c == '\n' ? std::string("\n") + std::string(6, ' ') : std::string(1, c);
  return result;
}

}  // namespace

std::string paperHelp() {
  std::ostringstream out;
  out << "--paper KEY=VALUE[,KEY=VALUE...] fits by the paper's method, for\n"
         "comparison. '--paper default' changes no setting. --count is the number of ellipsoids\n"
         "that the last pruning pass keeps. The file stores float32 unless --storage is given.\n"
         "\nKeys:\n";
  for (const Key& key : keys()) {
    out << "  " << key.name;
    if (!key.value.empty()) out << " (=" << key.value << ")";
    out << "\n      " << indented(key.help) << '\n';
  }
  return out.str();
}

namespace {

[[noreturn]] void refuseKey(const std::string& given) {
  std::vector<std::string> names;
  for (const Key& key : keys()) names.emplace_back(key.name);
  throw UsageError("--paper has no key '" + given + "'; see --help paper" +
                   didYouMean(given, names));
}

}  // namespace

PaperMethod readPaperMethod(const std::vector<std::string>& given) {
  auto settings = settingsIn(given);
  PaperMethod method;
  for (const Key& key : keys()) {
    const auto setting = settings.find(key.name);
    if (setting == settings.end()) continue;
    key.read(setting->second, method);
    settings.erase(setting);
  }
  if (!settings.empty()) refuseKey(settings.begin()->first);
  if (method.gaussian && (method.learnK || method.k != PaperMethod{}.k))
    throw UsageError("--paper: Gaussians have no k");
  return method;
}

// The report.

namespace {

using Json = nlohmann::ordered_json;

Json ratesOf(const PaperRates& rates) {
  return {{"position", rates.position},
          {"scale", rates.scale},
          {"rotation", rates.rotation},
          {"intensity", rates.intensity},
          {"k", rates.k}};
}

Json densifyOf(const PaperRecord& record) {
  const PaperMethod& m = record.method;
  if (!m.densify) return nullptr;
  return {{"from", m.densifyFrom},
          {"until", m.densifyUntil},
          {"every", m.densifyEvery},
          {"threshold", m.gradientThreshold},
          {"first_median_gradient", record.firstGradient},
          {"percent_dense", m.percentDense},
          {"max", m.maxEllipsoids},
          {"cloned", record.cloned},
          {"split", record.split}};
}

Json prunesOf(const PaperRecord& record) {
  Json passes = Json::array();
  for (const PruneRecord& pass : record.prunes)
    passes.push_back({{"epoch", pass.epoch},
                      {"before", pass.before},
                      {"after", pass.after},
                      {"psnr_box_before", pass.psnrBoxBefore},
                      {"psnr_box_after", pass.psnrBoxAfter},
                      {"hits_before", pass.hitsBefore}});
  return passes;
}

}  // namespace

Json paperJson(const PaperRecord& record) {
  const PaperMethod& m = record.method;
  return {{"kernel", m.gaussian ? "gaussian" : "ellipsoid"},
          {"k", m.gaussian ? Json(nullptr) : (m.learnK ? Json("learned") : Json(m.k))},
          {"beta", m.beta},
          {"points", record.points},
          {"epochs", m.epochs},
          {"iterations", record.iterations},
          {"subvolume_side", record.subvolumeSide},
          {"subvolumes", record.subvolumes},
          {"rates", ratesOf(m.rates)},
          {"densify", densifyOf(record)},
          {"prune_score", cli::wordOf(m.score, kScores)},
          {"prunes", prunesOf(record)},
          {"hits", record.hits}};
}

}  // namespace esvr::vdb2esvr
