#include <algorithm>
#include <string>

#include "render/option_groups.h"

namespace esvr::render {

using cli::po::bool_switch;
using cli::po::value;

namespace {

constexpr int kMostSamples = 16;  // a mean of more rays does not differ in 8 bits

int samplesOf(const cli::Arguments& a, const Options& options) {
  const int samples = a.get<int>("ref-supersample");
  cli::requireRange("ref-supersample", samples, 1, kMostSamples);
  const Resolution r = options.resolution;
  if (samples * std::max(r.width, r.height) > Resolution::kMaxSide)
    throw UsageError("--ref-supersample makes a picture with a side of more than " +
                     std::to_string(Resolution::kMaxSide) + " pixels");
  if (samples > 1 && options.reference.empty()) throw UsageError("--ref-supersample needs --ref");
  return samples;
}

}  // namespace

void addMeasuringOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("ref", value<std::string>()->value_name("FILE"),
     "compare each picture with a picture of this VDB")
    ("ref-supersample", value<int>()->value_name("N")->default_value(1),
     "draw the picture of --ref with N x N rays a pixel, and without levels of detail")
    ("sheet", value<std::string>()->value_name("FILE.png"),
     "write the picture, the picture of --ref and their error side by side")
    ("bench", bool_switch(),
     "measure the speed over 720 views of a full turn, or as many as --turntable says")
    ("report", value<std::string>()->value_name("FILE.json"),
     "write the results of --bench or --ref; '-' is the standard output");
  // clang-format on
}

void readMeasuringOptions(const cli::Arguments& a, Options& options) {
  options.reference = a.find<std::string>("ref").value_or("");
  options.referenceSamples = samplesOf(a, options);
  options.sheet = a.find<std::string>("sheet").value_or("");
  options.bench = a.get<bool>("bench");
  if (!options.sheet.empty() && (options.reference.empty() || options.bench))
    throw UsageError("--sheet needs --ref, and cannot be given with --bench");
  options.report = a.find<std::string>("report").value_or("");
  if (options.bench && !options.depth.empty())
    throw UsageError("--bench writes no picture; leave --depth out");
  if (options.bench && options.legend)
    throw UsageError("--bench writes no picture; leave --legend out");
  if (options.bench != options.output.empty())
    throw UsageError(options.bench ? "--bench writes no picture; leave OUT.png out"
                                   : "OUT.png is missing");
  if (!options.report.empty() && !options.bench && options.reference.empty())
    throw UsageError("--report writes the results of --bench or --ref; give one of them");
}

}  // namespace esvr::render
