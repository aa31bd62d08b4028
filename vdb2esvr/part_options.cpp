#include "vdb2esvr/part_options.h"

#include <cstdint>
#include <optional>
#include <string>

#include "cli/number.h"
#include "esvr/error.h"
#include "vdb2esvr/refuse_with.h"

namespace esvr::vdb2esvr {
namespace {

using cli::po::bool_switch;
using cli::po::value;

/// The share that a text K/N with 1 <= K <= N names.
PartShare partShare(const std::string& text) {
  const auto slash = text.find('/');
  const auto number = cli::parseWhole(text.substr(0, slash));
  const auto count = slash == text.npos ? std::nullopt : cli::parseWhole(text.substr(slash + 1));
  constexpr std::int64_t kMostParts = 1'000'000;
  if (!number || !count || *number < 1 || *number > *count || *count > kMostParts)
    throw UsageError("--part must be K/N with K from 1 to N, not '" + text + "'");
  return {int(*number), int(*count)};
}

}  // namespace

void addPartOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("resume", bool_switch(),
     "keep the finished parts of a fit in chunks in the folder OUT.esvr.parts until OUT.esvr is "
     "written, and continue from those that are there")
    ("part", value<std::string>()->value_name("K/N"),
     "fit the K-th of N shares of the parts and write them to OUT.esvr.parts, for job arrays; "
     "--merge then writes OUT.esvr")
    ("merge", bool_switch(), "write OUT.esvr from the parts in OUT.esvr.parts");
  // clang-format on
}

void readParts(const cli::Arguments& a, Options& options) {
  options.resume = a.get<bool>("resume");
  if (a.get<bool>("merge")) options.job = Job::kMerge;
  if (const auto part = a.find<std::string>("part")) {
    refuseWith(a, "part", {"merge", "report"});
    options.job = Job::kPart;
    options.share = partShare(*part);
  }
  const bool isStored = options.resume || options.job != Job::kWhole;
  if (isStored && !options.inputs.piped.empty())
    throw UsageError("parts are fitted in several runs, which need an input file, not a pipe");
  if (isStored && options.paper) throw UsageError("fits by --paper have no parts");
  // An interrupted run is continued later. A share of the parts has no result to keep.
  options.keepsBest = !isStored;
}

}  // namespace esvr::vdb2esvr
