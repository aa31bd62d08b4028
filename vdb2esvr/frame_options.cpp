#include "vdb2esvr/frame_options.h"

#include <string>
#include <variant>

#include "cli/number.h"
#include "cli/sequence.h"
#include "esvr/error.h"

namespace esvr::vdb2esvr {
namespace {

using cli::Arguments;
using cli::po::value;

constexpr std::int64_t kMostGroupFrames = 1'000'000;

/// Reads the options of the groups of a file that holds a sequence.
void readGroups(const Arguments& a, Options& options) {
  const bool isOneFile = options.sequence && options.sequence->output.isWhole();
  for (const char* option : {"gop", "steadiness"})
    if (!isOneFile && !a.values[option].defaulted())
      throw UsageError("--" + std::string(option) +
                       " needs a sequence as input and one file, without a pattern, as output");
  const auto frames = a.get<std::int64_t>("gop");
  cli::requireRange("gop", frames, std::int64_t{1}, kMostGroupFrames);
  options.groupFrames = std::size_t(frames);
  options.convert.steadiness = a.get<double>("steadiness");
  cli::requireRange("steadiness", options.convert.steadiness, 0.0, 1.0);
}

}  // namespace

void addFrameOptions(cli::po::options_description& options) {
  cli::addSequenceOptions(options);
  // clang-format off
  options.add_options()
    ("gop", value<std::int64_t>()->value_name("N")->default_value(std::int64_t(kUsualGroupFrames)),
     "with one file as output of a sequence: frames of a group; a reader needs at most one group to "
     "decode a frame, and --resume loses at most the groups that were not complete")
    ("steadiness", value<double>()->value_name("S")->default_value(ConvertOptions{}.steadiness),
     "with one file as output of a sequence: weight of flicker, from 0 (least bytes) to 1 (least "
     "flicker), in the choice of voxels");
  // clang-format on
}

void readFrames(const Arguments& a, Options& options) {
  options.sequence = cli::readSequence(a, {.output = true});
  readGroups(a, options);
  if (!options.sequence) return;
  for (const char* option : {"part", "merge"})
    if (a.has(option) && !a.values[option].defaulted())
      throw UsageError("--" + std::string(option) +
                       " is for one volume; give each job some frames of the sequence (--frames)");
  if (options.resume && a.get<bool>("force"))
    throw UsageError(
        "--resume keeps the frames that are there, and --force replaces them; choose one");
  if (auto* goal = std::get_if<PresetGoal>(&options.convert.goal)) goal->steady = true;
  // A frame that ended early would look as if it were complete.
  if (a.values["on-cancel"].defaulted()) options.onCancel = OnCancel::kDiscard;
}

}  // namespace esvr::vdb2esvr
