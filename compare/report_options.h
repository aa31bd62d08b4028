#pragma once
/// Options for reports, which several jobs have.

#include <filesystem>
#include <string>
#include <vector>

#include "cli/command_line.h"

namespace esvr::compare {

/// Files that a report goes into; empty where not asked for.
struct ReportFiles {
  std::string json, markdown, csv, html;
  bool overwrite = false;
};

void addReportOptions(cli::po::options_description& options);
[[nodiscard]] ReportFiles reportFiles(const cli::Arguments& arguments);

/// Fails before the work where writing would fail after it. \throws UsageError, RuntimeFailure
void checkReportFiles(const ReportFiles& files, const std::vector<std::filesystem::path>& inputs);

[[nodiscard]] std::vector<std::string> splitAtCommas(const std::string& text);

}  // namespace esvr::compare
