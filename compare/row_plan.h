#pragma once
/// Which baselines a comparison has.

#include <string>
#include <vector>

#include "compare/table_options.h"
#include "esvr/baseline.h"

namespace esvr::compare {

/// What ratios are to.
[[nodiscard]] BaselineSetting halfBlosc();

[[nodiscard]] std::vector<BaselineSetting> losslessSettings();

/// A setting, and what its row is called.
struct NamedSetting {
  BaselineSetting setting;
  std::string name;
};
[[nodiscard]] std::vector<NamedSetting> quantisedSettings(double peak);

/// Forms of which the best setting for a size, or for a PSNR, is looked for.
[[nodiscard]] std::vector<BaselineSetting> sizeForms(const TableOptions& options);
[[nodiscard]] std::vector<BaselineSetting> psnrForms(const TableOptions& options);

}  // namespace esvr::compare
