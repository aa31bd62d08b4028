#pragma once
/// Figures kept from an earlier run, in a JSON file:
///
///     {"schema": "esvr-baseline", "schema_version": 1,
///      "bytes": {"value": 21704, "tolerance": 217},
///      "grids": {"density": {"psnr_box": {"value": 58.3, "tolerance": 0.05}, ...}}}
///
/// null in place of a PSNR's value means that there was no error at all. Figures may be left out.

#include <filesystem>

#include "compare/check_record.h"

namespace esvr::compare {

/// Appends failures for what is worse by more than its tolerance, and notes for what is better and
/// for grids that the baseline does not know.
/// \throws BadInput  missing, not such a file
void judgeBaseline(const std::filesystem::path& path, CheckRecord& record);

/// True where the baseline has an SSIM, which is then to be measured. A file that is not there has
/// none.
[[nodiscard]] bool baselineHasSsim(const std::filesystem::path& path);

/// Writes the record's figures; tolerances of a file that is there stay.
/// \throws BadInput  what is there is no baseline; RuntimeFailure: not writable
void updateBaseline(const std::filesystem::path& path, const CheckRecord& record);

}  // namespace esvr::compare
