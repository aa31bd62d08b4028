#include "compare/report_options.h"

#include "cli/json_file.h"
#include "cli/output.h"

namespace esvr::compare {

using cli::po::bool_switch;
using cli::po::value;

void addReportOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("report", value<std::string>()->value_name("FILE.json"),
     "write all results as JSON; '-' is stdout")
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
  std::vector<std::filesystem::path> outputs;
  const auto check = [&](const std::string& file, const char* extension) {
    if (file.empty() || file == cli::kStandardOutput) return;
    outputs.emplace_back(file);
    for (const auto& input : inputs) cli::requireDistinct({input, file});
    cli::checkOutput(file, {extension}, files.overwrite);
  };
  check(files.json, ".json");
  check(files.markdown, ".md");
  check(files.csv, ".csv");
  check(files.html, ".html");
  cli::requireDistinct(outputs);
}

std::vector<std::string> splitAtCommas(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

}  // namespace esvr::compare
