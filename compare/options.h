#pragma once
/// What the commands of esvr-compare share: options, names of reports, and the versions in them.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "esvr/volume.h"
#include "programs/command_line.h"

namespace esvr::compare {

inline constexpr const char* kProgram = "esvr-compare";

/// The whole command line as words. \param argv  arguments, beginning with the command
[[nodiscard]] std::vector<std::string> commandLine(int argc, const char* const* argv);
/// Joins words to one line.
[[nodiscard]] std::string joined(const std::vector<std::string>& words);

/// Adds --box and --peak, which say how errors are measured.
void addMeasureOptions(cli::po::options_description& options);
/// \throws UsageError  the text is no box
[[nodiscard]] std::optional<Box> boxOption(const cli::Arguments& arguments);
/// \throws UsageError  the peak is not above 0
[[nodiscard]] std::optional<double> peakOption(const cli::Arguments& arguments);

/// The files of a report; empty for those that are not written.
struct ReportFiles {
  std::string json, markdown, csv, html;
  bool overwrite = false;
};

/// Adds --report.
void addJsonReport(cli::po::options_description& options);
/// Adds --report and the other forms of a report.
void addReportOptions(cli::po::options_description& options);
[[nodiscard]] ReportFiles reportFiles(const cli::Arguments& arguments);

/// Checks before the work that the files can be written.
/// \throws UsageError, RuntimeFailure  a file cannot be written
void checkReportFiles(const ReportFiles& files, const std::vector<std::filesystem::path>& inputs);

/// One line for the program, the format and each library.
[[nodiscard]] std::vector<std::string> versionLines();
/// The versions that reports of all programs have, and that of ZFP; null if there is none.
[[nodiscard]] nlohmann::ordered_json versionJson();

}  // namespace esvr::compare
