#include "compare/report_options.h"

#include "cli/json_file.h"
#include "cli/output.h"

namespace esvr::compare {

using cli::po::bool_switch;
using cli::po::value;

void addJsonReport(cli::po::options_description& options) {
  options.add_options()("report", value<std::string>()->value_name("FILE.json"),
                        "write all results as JSON; '-' is stdout");
}

void addReportOptions(cli::po::options_description& options) {
  addJsonReport(options);
  // clang-format off
  options.add_options()
    ("markdown", value<std::string>()->value_name("FILE.md"), "write the tables as Markdown")
    ("csv", value<std::string>()->value_name("FILE.csv"),
     "write the figures with all digits as CSV")
    ("html", value<std::string>()->value_name("FILE.html"), "write a self-contained HTML page")
    ("force,f", bool_switch(), "replace reports that exist");
  // clang-format on
}

ReportFiles reportFiles(const cli::Arguments& a) {
  const auto path = [&](const char* option) { return a.find<std::string>(option).value_or(""); };
  return {path("report"), path("markdown"), path("csv"), path("html"), a.get<bool>("force")};
}

void checkReportFiles(const ReportFiles& files, const std::vector<std::filesystem::path>& inputs) {
  cli::requireSeparate(inputs, {files.json, files.markdown, files.csv, files.html});
  const auto check = [&](const std::string& file, const char* extension) {
    if (file.empty() || file == cli::kStandardOutput) return;
    cli::checkOutput(file, {extension}, files.overwrite);
  };
  check(files.json, ".json");
  check(files.markdown, ".md");
  check(files.csv, ".csv");
  check(files.html, ".html");
}

}  // namespace esvr::compare
