#pragma once
/// Options that the commands of esvr-compare share.

#include <optional>
#include <string>
#include <vector>

#include "esvr/volume.h"
#include "programs/command_line.h"

namespace esvr::compare {

inline constexpr const char* kProgram = "esvr-compare";

/// The whole command line as words. \param argv  arguments, beginning with the command
[[nodiscard]] std::vector<std::string> commandLine(int argc, const char* const* argv);

/// Adds --box and --peak, which say how errors are measured.
void addMeasureOptions(cli::po::options_description& options);
/// \throws UsageError  the text is no box
[[nodiscard]] std::optional<Box> boxOption(const cli::Arguments& arguments);
/// \throws UsageError  the peak is not above 0
[[nodiscard]] std::optional<double> peakOption(const cli::Arguments& arguments);

/// Adds --report.
void addJsonReport(cli::po::options_description& options);
}  // namespace esvr::compare
