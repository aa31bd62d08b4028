#pragma once
/// Judges what `check` has measured, by the limits of the options and by a baseline. A baseline has
/// figures of an earlier run in a JSON file, for example
///
///     {"schema": "esvr-baseline", "schema_version": 1,
///      "bytes": {"value": 21704, "tolerance": 217},
///      "grids": {"density": {"psnr_box": {"value": 58.3, "tolerance": 0.05}, ...}}}
///
/// A PSNR of null means that there was no error. Figures may be left out.

#include <filesystem>

#include "compare/check.h"

namespace esvr::compare {

/// Appends a line to the record's failures for every limit that a grid misses.
void judgeLimits(const CheckOptions& options, CheckRecord& record);

/// Appends a line if the file is larger than allowed.
void judgeBytes(const CheckOptions& options, CheckRecord& record);

/// Appends a line for every difference of the kinds that fail.
void judgeDifferences(const CheckOptions& options, CheckRecord& record);

/// Appends failures for figures that are worse by more than their tolerance, and notes for figures
/// that are better and for grids that the baseline does not have.
/// \throws BadInput  the file is missing or is not a baseline
void judgeBaseline(const std::filesystem::path& path, CheckRecord& record);

/// True if the file exists and has an SSIM, which must then be measured.
[[nodiscard]] bool baselineHasSsim(const std::filesystem::path& path);

/// Writes the record's figures. Tolerances of an existing file are kept.
/// \throws BadInput  the existing file is not a baseline
/// \throws RuntimeFailure  the file is not writable
void updateBaseline(const std::filesystem::path& path, const CheckRecord& record);

}  // namespace esvr::compare
