#include "compare/options.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "esvr/baseline.h"
#include "programs/files.h"
#include "programs/option_values.h"

namespace esvr::compare {

using cli::po::bool_switch;
using cli::po::value;

std::vector<std::string> commandLine(int argc, const char* const* argv) {
  std::vector<std::string> words{kProgram};
  words.insert(words.end(), argv, argv + argc);
  return words;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

// How errors are measured.

void addMeasureOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("box", value<std::string>()->value_name("BOX"),
     "box x0,y0,z0,x1,y1,z1 over which figures are measured (default: the bounding box of "
     "the reference's active voxels)")
    ("peak", value<double>()->value_name("P"),
     "peak of the PSNR (default: the range of the reference's values, "
     "which is the largest value of a density; docs/compare.md)");
  // clang-format on
}

std::optional<Box> boxOption(const cli::Arguments& a) {
  const auto box = a.find<std::string>("box");
  return box ? std::optional(cli::parseBox(*box)) : std::nullopt;
}

std::optional<double> peakOption(const cli::Arguments& a) {
  const auto peak = a.find<double>("peak");
  if (peak)
    cli::requireRange("peak", *peak, std::numeric_limits<double>::min(),
                      std::numeric_limits<double>::max());
  return peak;
}

// Reports.

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

std::vector<std::string> versionLines() {
  std::vector<std::string> lines;
  std::string text = cli::versionText(kProgram);
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  if (!zfpVersion().empty()) lines.push_back(zfpVersion());
  return lines;
}

nlohmann::ordered_json versionJson() {
  nlohmann::ordered_json versions = cli::versionJson();
  versions["zfp"] = nullptr;
  if (!zfpVersion().empty()) versions["zfp"] = zfpVersion();
  return versions;
}

}  // namespace esvr::compare
