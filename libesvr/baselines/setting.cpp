#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <span>

#include "core/parse_text.h"
#include "esvr/baseline.h"
#include "esvr/error.h"

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

}  // namespace esvr
