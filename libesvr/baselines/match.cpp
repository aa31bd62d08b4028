#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "baselines/voxels.h"
#include "core/parse_text.h"
#include "esvr/baseline.h"
#include "esvr/error.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

struct FormWord {
  const char* word;
  PackedForm form;
};
constexpr std::array kForms{FormWord{"vdb-float", PackedForm::kOpenVdbFloat},
                            FormWord{"vdb-half", PackedForm::kOpenVdbHalf},
                            FormWord{"nvdb-float", PackedForm::kNanoFloat},
                            FormWord{"nvdb-fp16", PackedForm::kNanoFp16},
                            FormWord{"nvdb-fp8", PackedForm::kNanoFp8},
                            FormWord{"nvdb-fp4", PackedForm::kNanoFp4},
                            FormWord{"nvdb-fpn", PackedForm::kNanoFpN}};

struct CodecWord {
  const char* ending;
  PackedCodec codec;
};
constexpr std::array kCodecs{CodecWord{"-zip", PackedCodec::kZip},
                             CodecWord{"-blosc", PackedCodec::kBlosc},
                             CodecWord{"", PackedCodec::kNone}};

constexpr const char *kZfp = "zfp", *kZfpBricks = "zfp-bricks", *kAccuracy = "accuracy",
                     *kPrecision = "precision", *kTolerance = "tolerance",
                     *kThreshold = "threshold";

/// The shortest text that represents the same number.
std::string exactText(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string wordsOf(const VoxelPacking& packing) {
  std::string text;
  for (const auto& form : kForms)
    if (form.form == packing.form) text = form.word;
  for (const auto& codec : kCodecs)
    if (codec.codec == packing.codec) return text + codec.ending;
  return text;
}

std::optional<VoxelPacking> packingOf(const std::string& word) {
  for (const auto& form : kForms)
    for (const auto& codec : kCodecs)
      if (word == std::string(form.word) + codec.ending)
        return VoxelPacking{.form = form.form, .codec = codec.codec};
  return std::nullopt;
}

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw UsageError("'" + text + "' is not a baseline: " + why);
}

double numberOf(const std::string& text, const std::string& number) {
  const auto value = parseNumber(number);
  if (!value || !(*value > 0.0)) refuse(text, "'" + number + "' is not a number above 0");
  return *value;
}

void applyParameter(const std::string& text, const std::string& key, double value,
                    BaselineSetting& setting) {
  auto* packing = std::get_if<VoxelPacking>(&setting.how);
  auto* zfp = std::get_if<ZfpSetting>(&setting.how);
  if (packing && key == kThreshold)
    setting.threshold = value;
  else if (packing && packing->form == PackedForm::kNanoFpN && key == kTolerance)
    packing->tolerance = value;
  else if (zfp && key == kAccuracy)
    *zfp = {ZfpMode::kAccuracy, value, zfp->bricks};
  else if (zfp && key == kPrecision)
    *zfp = {ZfpMode::kPrecision, value, zfp->bricks};
  else
    refuse(text, "it takes no " + key);
}

void requireParameters(const std::string& text, const BaselineSetting& setting) {
  const auto* packing = std::get_if<VoxelPacking>(&setting.how);
  const auto* zfp = std::get_if<ZfpSetting>(&setting.how);
  if (packing && packing->form == PackedForm::kNanoFpN && packing->tolerance == 0.0)
    refuse(text, std::string("it needs ") + kTolerance + "=...");
  if (zfp && zfp->amount == 0.0)
    refuse(text, std::string("it needs ") + kAccuracy + "=... or " + kPrecision + "=...");
}

std::string parameters(const BaselineSetting& setting) {
  std::string text;
  const auto add = [&](const char* key, double value) {
    text += std::string(",") + key + "=" + exactText(value);
  };
  if (const auto* packing = std::get_if<VoxelPacking>(&setting.how)) {
    if (packing->form == PackedForm::kNanoFpN) add(kTolerance, packing->tolerance);
    if (setting.threshold > 0.0) add(kThreshold, setting.threshold);
  } else {
    const auto& zfp = std::get<ZfpSetting>(setting.how);
    add(zfp.mode == ZfpMode::kAccuracy ? kAccuracy : kPrecision, zfp.amount);
  }
  return text;
}

}  // namespace

std::string toString(const BaselineSetting& setting) {
  if (const auto* packing = std::get_if<VoxelPacking>(&setting.how))
    return wordsOf(*packing) + parameters(setting);
  const bool bricks = std::get<ZfpSetting>(setting.how).bricks;
  return (bricks ? kZfpBricks : kZfp) + parameters(setting);
}

BaselineSetting parseBaseline(const std::string& text) {
  const auto parts = splitText(text, ',');
  BaselineSetting setting;
  if (parts.front() == kZfp || parts.front() == kZfpBricks)
    setting.how = ZfpSetting{.bricks = parts.front() == kZfpBricks};
  else if (const auto packing = packingOf(parts.front()))
    setting.how = *packing;
  else
    refuse(text,
           "it begins with vdb-float, vdb-half, nvdb-float, nvdb-fp16, nvdb-fp8, nvdb-fp4 or "
           "nvdb-fpn, with -zip or -blosc, or with zfp or zfp-bricks");
  for (const auto& part : std::span(parts).subspan(1)) {
    const std::size_t equals = std::min(part.find('='), part.size());
    const std::string number = part.substr(std::min(equals + 1, part.size()));
    applyParameter(text, part.substr(0, equals), numberOf(text, number), setting);
  }
  requireParameters(text, setting);
  return setting;
}

// ---- The search

namespace {

constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();
/// Share of the wanted bytes at which a bisection of the threshold ends.
constexpr double kSufficientFill = 0.98;
constexpr int kMaxBisections = 24;  // enough for 2^24 distinct values

/// FpN's tolerances in the search for a size, as shares of the peak, from coarse to fine in steps
/// of about sqrt(2).
constexpr std::array kTolerances{0.5,    0.35,   0.25,   0.17, 0.12,  0.085, 0.06,   0.042,
                                 0.03,   0.02,   0.014,  0.01, 0.007, 0.005, 0.0035, 0.0025,
                                 1.7e-3, 1.2e-3, 8.5e-4, 6e-4, 4e-4,  3e-4,  2e-4,   1e-4};
constexpr int kMaxWorseTolerances = 3;  // number of consecutive worse tolerances at which it ends

constexpr int kAccuracySteps = 40;  // number of accuracies, which are powers of two

/// Tries settings and keeps the best result.
class Search {
 public:
  explicit Search(BaselineEncoder& encoder, bool active = false)
      : encoder_(encoder), active_(active) {}

  /// Encodes with a setting. \return the bytes
  std::uint64_t tryBytes(const BaselineSetting& setting) {
    match_.steps.push_back({setting, encoder_.encode(setting).bytes, kNotMeasured});
    return match_.steps.back().bytes;
  }
  /// Measures the PSNR of the last setting.
  double measure() {
    const BaselineSource& source = encoder_.source();
    const CompareOptions options{.box = source.box, .peak = source.peak};
    const SparseVolume decoded = encoder_.decode();
    const SparseVolume& reference = source.grid.volume;
    return match_.steps.back().psnr = active_
                                          ? compareVolumes(reference, decoded, options).psnrActive
                                          : psnrOverBox(reference, decoded, options);
  }
  const MatchStep& last() const { return match_.steps.back(); }

  void keepIfCloser() {
    if (!match_.found || last().psnr > match_.best.psnr) keep();
  }
  void keepIfSmaller() {
    if (!match_.found || last().bytes < match_.best.bytes) keep();
  }
  [[nodiscard]] std::uint64_t bestBytes() const {
    return match_.found ? match_.best.bytes : std::numeric_limits<std::uint64_t>::max();
  }
  [[nodiscard]] double bestPsnr() const {
    return match_.found ? match_.best.psnr : -std::numeric_limits<double>::infinity();
  }
  Match take() { return std::move(match_); }
  [[nodiscard]] const BaselineSource& source() const { return encoder_.source(); }

 private:
  void keep() {
    match_.best = last();
    match_.found = true;
  }

  BaselineEncoder& encoder_;
  bool active_;  ///< whether the PSNR is that over the active voxels
  Match match_;
};

/// Searches the lowest threshold whose file is small enough, by bisection over the distinct
/// deviations. The result is measured, and kept if its PSNR is the highest so far.
/// \return false if no threshold makes the file small enough
bool matchThreshold(Search& search, BaselineSetting setting, std::span<const float> thresholds,
                    std::uint64_t bytes) {
  setting.threshold = 0.0;
  if (search.tryBytes(setting) <= bytes) {
    search.measure();
    search.keepIfCloser();
    return true;
  }
  std::size_t low = 0, high = thresholds.size();  // the last threshold would drop all voxels
  std::optional<double> found;
  for (int i = 0; i < kMaxBisections && low + 1 < high; ++i) {
    const std::size_t middle = low + (high - low) / 2;
    setting.threshold = thresholds[middle - 1];
    const std::uint64_t size = search.tryBytes(setting);
    (size > bytes ? low : high) = middle;
    if (size <= bytes) found = setting.threshold;
    if (size <= bytes && double(size) >= kSufficientFill * double(bytes)) break;
  }
  if (!found) return false;
  setting.threshold = *found;
  search.tryBytes(setting);
  search.measure();
  search.keepIfCloser();
  return true;
}

void matchToleranceAndThreshold(Search& search, const BaselineSetting& like,
                                std::span<const float> thresholds, std::uint64_t bytes) {
  int worse = 0;
  for (const double share : kTolerances) {
    BaselineSetting setting = like;
    std::get<VoxelPacking>(setting.how).tolerance = share * search.source().peak;
    const double before = search.bestPsnr();
    const bool fits = matchThreshold(search, setting, thresholds, bytes);
    // An equal PSNR does not count as worse: a leaf's bits are 1, 2, 4, 8 or 16, so several
    // tolerances give the same file.
    worse = fits && search.last().psnr >= before ? 0 : worse + 1;
    if (worse == kMaxWorseTolerances) return;
  }
}

/// ZFP's settings of a mode, from coarse to fine.
std::vector<BaselineSetting> ladder(ZfpSetting zfp, double peak) {
  std::vector<BaselineSetting> settings;
  const auto add = [&](double amount) {
    zfp.amount = amount;
    settings.push_back({.how = zfp});
  };
  if (zfp.mode == ZfpMode::kPrecision) {
    for (unsigned planes = 1; planes <= kMaxZfpPlanes; ++planes) add(planes);
    return settings;
  }
  const int first = std::ilogb(peak) + 3;  // above the peak, since ZFP's errors are below its bound
  for (int i = 0; i < kAccuracySteps; ++i) add(std::ldexp(1.0, first - i));
  return settings;
}

void matchZfpSize(Search& search, const ZfpSetting& zfp, std::uint64_t bytes) {
  for (const auto& setting : ladder(zfp, search.source().peak)) {
    if (search.tryBytes(setting) > bytes) return;
    search.measure();
    search.keepIfCloser();
  }
}

void matchZfpPsnr(Search& search, const ZfpSetting& zfp, double psnr) {
  for (const auto& setting : ladder(zfp, search.source().peak)) {
    search.tryBytes(setting);
    if (search.measure() < psnr) continue;
    search.keepIfSmaller();
    return;
  }
}

/// Searches the coarsest tolerance that reaches a PSNR, by bisection of its logarithm.
void matchTolerance(Search& search, BaselineSetting setting, double psnr) {
  constexpr int kSteps = 12;  // the tolerance is then accurate to 0.3 %
  auto& tolerance = std::get<VoxelPacking>(setting.how).tolerance;
  double coarse = std::log(search.source().peak), fine = coarse + std::log(1e-5);
  for (int i = 0; i < kSteps; ++i) {
    const double middle = (coarse + fine) / 2;
    tolerance = std::exp(middle);
    search.tryBytes(setting);
    const bool reached = search.measure() >= psnr;
    if (reached) search.keepIfSmaller();
    (reached ? fine : coarse) = middle;
  }
}

/// Searches the highest threshold that reaches a PSNR, by bisection over the distinct deviations.
/// \return false if the PSNR is not reached without a threshold
bool matchThresholdToPsnr(Search& search, BaselineSetting setting,
                          std::span<const float> thresholds, double psnr) {
  constexpr double kSufficientExcess = 0.05;  // dB
  const auto reached = [&](double threshold) {
    setting.threshold = threshold;
    search.tryBytes(setting);
    if (search.measure() < psnr) return false;
    search.keepIfSmaller();
    return true;
  };
  if (!reached(0.0)) return false;
  std::size_t low = 0, high = thresholds.size();  // the last threshold would drop all voxels
  for (int i = 0; i < kMaxBisections && low + 1 < high; ++i) {
    const std::size_t middle = low + (high - low) / 2;
    const bool isReached = reached(thresholds[middle - 1]);
    (isReached ? low : high) = middle;
    if (isReached && search.last().psnr <= psnr + kSufficientExcess) break;
  }
  return true;
}

/// Tries FpN's tolerances from coarse to fine, each with the highest threshold.
void matchToleranceAndThresholdToPsnr(Search& search, BaselineSetting setting,
                                      std::span<const float> thresholds, double psnr) {
  int worse = 0;
  for (const double share : kTolerances) {
    std::get<VoxelPacking>(setting.how).tolerance = share * search.source().peak;
    const std::uint64_t before = search.bestBytes();
    if (!matchThresholdToPsnr(search, setting, thresholds, psnr)) continue;
    worse = search.bestBytes() < before ? 0 : worse + 1;
    if (worse == kMaxWorseTolerances) return;
  }
}

void matchPackingToPsnr(Search& search, const BaselineSetting& like, const MatchGoal& goal) {
  const bool hasTolerance = std::get<VoxelPacking>(like.how).form == PackedForm::kNanoFpN;
  if (!hasTolerance && !goal.dropsVoxels)
    throw UsageError("only FpN and ZFP have a setting that can be matched to a PSNR");
  if (hasTolerance) matchTolerance(search, like, goal.psnr);
  if (!goal.dropsVoxels) return;
  const auto thresholds = baselines::thresholds(search.source().grid);
  if (hasTolerance)
    matchToleranceAndThresholdToPsnr(search, like, thresholds, goal.psnr);
  else
    (void)matchThresholdToPsnr(search, like, thresholds, goal.psnr);
}

}  // namespace

Match matchSize(BaselineEncoder& encoder, const BaselineSetting& like, std::uint64_t bytes) {
  Search search(encoder);
  if (const auto* zfp = std::get_if<ZfpSetting>(&like.how)) {
    matchZfpSize(search, *zfp, bytes);
    return search.take();
  }
  const auto thresholds = baselines::thresholds(encoder.source().grid);
  if (std::get<VoxelPacking>(like.how).form == PackedForm::kNanoFpN)
    matchToleranceAndThreshold(search, like, thresholds, bytes);
  else
    (void)matchThreshold(search, like, thresholds, bytes);
  return search.take();
}

Match matchPsnr(BaselineEncoder& encoder, const BaselineSetting& like, const MatchGoal& goal) {
  Search search(encoder, goal.active);
  if (const auto* zfp = std::get_if<ZfpSetting>(&like.how))
    matchZfpPsnr(search, *zfp, goal.psnr);
  else
    matchPackingToPsnr(search, like, goal);
  return search.take();
}

}  // namespace esvr
