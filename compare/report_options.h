#pragma once
/// Options for reports, which several commands have.

#include <filesystem>
#include <string>
#include <vector>

#include "cli/command_line.h"

namespace esvr::compare {

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

}  // namespace esvr::compare
