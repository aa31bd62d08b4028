#include "compare/row_plan.h"

#include "compare/measure.h"

namespace esvr::compare {
namespace {

constexpr PackedCodec kNone = PackedCodec::kNone, kZip = PackedCodec::kZip,
                      kBlosc = PackedCodec::kBlosc;
/// The tolerances of FpN in a table: the peak divided by these numbers.
constexpr int kTolerances[] = {1024, 256, 64};

BaselineSetting packed(PackedForm form, PackedCodec codec, double tolerance = 0.0) {
  return {.how = VoxelPacking{form, codec, tolerance}};
}

BaselineSetting zfp(ZfpMode mode, bool bricks = false) {
  return {.how = ZfpSetting{mode, 0.0, bricks}};
}

}  // namespace

BaselineSetting halfBlosc() { return packed(PackedForm::kOpenVdbHalf, kBlosc); }

std::vector<BaselineSetting> losslessSettings() {
  using F = PackedForm;
  return {packed(F::kOpenVdbFloat, kBlosc), packed(F::kOpenVdbFloat, kZip),
          packed(F::kNanoFloat, kNone),     packed(F::kNanoFloat, kZip),
          packed(F::kNanoFloat, kBlosc),    packed(F::kOpenVdbHalf, kBlosc),
          packed(F::kOpenVdbHalf, kZip)};
}

std::vector<NamedSetting> quantisedSettings(double peak) {
  std::vector<NamedSetting> settings;
  const auto add = [&](const BaselineSetting& setting, const std::string& part) {
    std::string name = displayName(setting);
    if (!part.empty()) name.insert(name.rfind(' '), "/" + part);
    settings.push_back({setting, name});
  };
  for (const PackedCodec codec : {kNone, kZip}) {
    for (const PackedForm form :
         {PackedForm::kNanoFp16, PackedForm::kNanoFp8, PackedForm::kNanoFp4})
      add(packed(form, codec), "");
    for (const int part : kTolerances)
      add(packed(PackedForm::kNanoFpN, codec, peak / part), std::to_string(part));
  }
  return settings;
}

std::vector<BaselineSetting> sizeForms(const TableOptions& options) {
  using F = PackedForm;
  std::vector<BaselineSetting> forms;
  if (!options.settings.empty()) return forms;
  if (options.matched)
    forms = {packed(F::kOpenVdbHalf, kBlosc), packed(F::kNanoFloat, kZip),
             packed(F::kNanoFp16, kZip),      packed(F::kNanoFp8, kZip),
             packed(F::kNanoFp4, kZip),       packed(F::kNanoFpN, kZip),
             packed(F::kNanoFpN, kNone)};
  if (options.zfp && !zfpVersion().empty()) {
    forms.push_back(zfp(ZfpMode::kAccuracy));
    forms.push_back(zfp(ZfpMode::kPrecision));
  }
  return forms;
}

std::vector<BaselineSetting> psnrForms(const TableOptions& options) {
  std::vector<BaselineSetting> forms;
  if (!options.settings.empty()) return forms;
  if (options.matched) forms = {packed(PackedForm::kNanoFpN, kZip)};
  if (options.zfp && !zfpVersion().empty()) {
    forms.push_back(zfp(ZfpMode::kAccuracy));
    forms.push_back(zfp(ZfpMode::kPrecision));
  }
  return forms;
}

std::vector<BaselineSetting> activePsnrForms(const TableOptions& options) {
  std::vector<BaselineSetting> forms;
  if (!options.settings.empty()) return forms;
  if (options.matched)
    forms = {packed(PackedForm::kNanoFpN, kZip), packed(PackedForm::kNanoFp4, kZip)};
  if (options.zfp && !zfpVersion().empty()) {
    forms.push_back(zfp(ZfpMode::kAccuracy));
    forms.push_back(zfp(ZfpMode::kAccuracy, true));
  }
  return forms;
}

}  // namespace esvr::compare
