#include "compare/options.h"

#include <limits>

#include "programs/option_values.h"

namespace esvr::compare {

using cli::po::value;

std::vector<std::string> commandLine(int argc, const char* const* argv) {
  std::vector<std::string> words{kProgram};
  words.insert(words.end(), argv, argv + argc);
  return words;
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

void addJsonReport(cli::po::options_description& options) {
  options.add_options()("report", value<std::string>()->value_name("FILE.json"),
                        "write all results as JSON; '-' is stdout");
}

}  // namespace esvr::compare
