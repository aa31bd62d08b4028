#pragma once
/// The baselines of a comparison.

#include <string>
#include <vector>

#include "compare/table_options.h"
#include "esvr/baseline.h"

namespace esvr::compare {

/// The baseline to which ratios refer.
[[nodiscard]] BaselineSetting halfBlosc();

[[nodiscard]] std::vector<BaselineSetting> losslessSettings();

/// A setting and the name of its row.
struct NamedSetting {
  BaselineSetting setting;
  std::string name;
};
[[nodiscard]] std::vector<NamedSetting> quantisedSettings(double peak);

/// The forms for which the best setting for a size, or for a PSNR, is searched; none if --row names
/// the baselines.
[[nodiscard]] std::vector<BaselineSetting> sizeForms(const TableOptions& options);
[[nodiscard]] std::vector<BaselineSetting> psnrForms(const TableOptions& options);
/// Forms that are matched to a PSNR over the active voxels.
[[nodiscard]] std::vector<BaselineSetting> activePsnrForms(const TableOptions& options);

}  // namespace esvr::compare
