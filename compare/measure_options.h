#pragma once
/// The options that say how errors are measured, which all commands have.

#include <optional>

#include "cli/command_line.h"
#include "esvr/coord.h"

namespace esvr::compare {

/// Adds --box and --peak.
void addMeasureOptions(cli::po::options_description& options);

/// \throws UsageError  the text is no box
[[nodiscard]] std::optional<Box> boxOption(const cli::Arguments& arguments);
/// \throws UsageError  the peak is not above 0
[[nodiscard]] std::optional<double> peakOption(const cli::Arguments& arguments);

}  // namespace esvr::compare
