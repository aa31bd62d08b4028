#include "render/option_groups.h"

#include <algorithm>
#include <iterator>

#include "cli/frame_messages.h"
#include "cli/number_list.h"
#include "cli/sequence.h"
#include "esvr/error.h"
#include "render/camera_file.h"
#include "render/vector_option.h"
#include "report/video_file.h"

namespace esvr::render {
namespace {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;

constexpr int kMaxFrames = 9999;  // the number in a frame's file name has four digits

CameraWish cameraOf(const Arguments& a) {
  const auto file = a.find<std::string>("camera");
  CameraWish wish = file ? readCamera(*file) : CameraWish{};
  const auto replace = [](auto& wished, auto given) {
    if (given) wished = given;
  };
  replace(wish.eye, findVector(a, "eye"));
  replace(wish.center, findVector(a, "center"));
  replace(wish.up, findVector(a, "up"));
  replace(wish.fov, a.find<double>("fov"));
  replace(wish.height, a.find<double>("height"));
  if (a.get<bool>("orthographic")) wish.projection = Projection::kOrthographic;
  const bool orthographic = wish.projection == Projection::kOrthographic;
  if (wish.height && !orthographic)
    throw UsageError("--height says nothing without --orthographic");
  if (wish.fov && orthographic)
    throw UsageError("--fov says nothing with --orthographic; --height does");
  return wish;
}

int turntableOf(const Arguments& a) {
  const auto frames = a.find<int>("turntable");
  if (frames) cli::requireRange("turntable", *frames, 1, kMaxFrames);
  return frames.value_or(0);
}

/// \throws UsageError  --fps does not fit the output
void readFps(const Arguments& a, Options& options) {
  constexpr double kMinFps = 0.1, kMaxFps = 1000.0;
  if (!a.has("fps")) return;
  options.fps = a.get<double>("fps");
  cli::requireRange("fps", options.fps, kMinFps, kMaxFps);
  if (!report::isVideo(options.output))
    throw UsageError("--fps says nothing unless the output is a video (.mp4 or .webm)");
}

/// \throws UsageError  options say something that a video cannot do
void checkVideoOptions(const Arguments& a, const Options& options) {
  if (!report::isVideo(options.output)) return;
  if (options.turntable == 0 && !options.frames)
    throw UsageError("a video needs --turntable or a sequence");
  if (a.has("ref")) throw UsageError("--ref compares pictures; a video has no files for them");
  if (a.get<int>("bits") != 8) throw UsageError("a video has 8 bits per channel; leave --bits out");
}

/// The frames of a pattern that are drawn. \throws BadInput  one of them is missing
void readPattern(const Arguments& a, const cli::FramePattern& pattern, Options& options) {
  const cli::FrameListing listing = cli::framesOnDisk(pattern);
  const auto range = a.find<std::string>("frames");
  options.pattern = pattern;
  options.frames = range ? cli::parseFrames("frames", *range) : listing.frames;
  options.frameHint = listing.hint(range ? &*options.frames : nullptr);
  std::vector<cli::FrameNumber> missing;
  std::ranges::copy_if(*options.frames, std::back_inserter(missing), [&](cli::FrameNumber frame) {
    return !std::ranges::binary_search(listing.frames, frame);
  });
  std::ranges::sort(missing);
  if (!missing.empty())
    throw BadInput(pattern.text() + ": " +
                   cli::sentenceOn(missing, options.frames->size(), "are missing") +
                   (options.frameHint.empty() ? "" : "; " + options.frameHint));
}

/// Checks the options of an input that is a sequence.
void checkSequenceOptions(const Arguments& a, const Options& options) {
  for (const char* option : {"turntable", "ref", "bench", "report"})
    if (a.has(option) && !a.values[option].defaulted())
      throw UsageError("--" + std::string(option) + " cannot be combined with a sequence");
  for (const auto& output : {options.output.string(), a.find<std::string>("depth").value_or("")})
    if (!output.empty() && !report::isVideo(output) && !cli::FramePattern::in(output))
      throw UsageError("'" + output +
                       "' needs a pattern such as #### for the number of a frame in the name of "
                       "the file, because '" +
                       options.input.string() + "' is a sequence");
}

void readFrames(const Arguments& a, Options& options) {
  const auto text = a.find<std::string>("frames");
  if (auto stored = cli::framesInFile(options.input)) {
    options.frames = text ? cli::parseFrames("frames", *text) : std::move(*stored);
    return checkSequenceOptions(a, options);
  }
  if (const auto pattern = cli::FramePattern::ofInput(options.input.string())) {
    readPattern(a, *pattern, options);
    return checkSequenceOptions(a, options);
  }
  if (!text) return;
  if (options.turntable == 0) throw UsageError("--frames needs --turntable or a sequence");
  const auto dash = text->find('-');
  if (dash == std::string::npos || dash == 0)
    throw UsageError("--frames must be like 0-35, not '" + *text + "'");
  const auto first = cli::parseNumbers("frames", text->substr(0, dash), 1)[0];
  const auto last = cli::parseNumbers("frames", text->substr(dash + 1), 1)[0];
  const bool whole = first == double(int(first)) && last == double(int(last));
  if (!whole || !(first >= 0.0 && first <= last && last < options.turntable))
    throw UsageError("--frames must be two of the turntable's numbers, from 0 to " +
                     std::to_string(options.turntable - 1) + ", not '" + *text + "'");
  options.firstFrame = int(first), options.lastFrame = int(last);
}

}  // namespace

void addCameraOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("camera", value<std::string>()->value_name("CAM.json"),
     "read the camera from a file; the options below replace values of the file")
    ("eye", value<std::string>()->value_name("X,Y,Z"), "position of the camera")
    ("center", value<std::string>()->value_name("X,Y,Z"), "point that the camera looks at")
    ("up", value<std::string>()->value_name("X,Y,Z"),
     "direction that points upwards in the picture (default: y)")
    ("fov", value<double>()->value_name("DEGREES"),
     "angle between the lower and the upper edge of the picture (default: 30)")
    ("orthographic", bool_switch(), "use parallel rays")
    ("height", value<double>()->value_name("H"),
     "height of an orthographic picture in voxels")
    ("turntable", value<int>()->value_name("N"),
     "draw N pictures of a full turn about the up axis, see the notes for their files")
    ("frames", value<std::string>()->value_name("A-B"),
     "draw only the pictures A to B of a turntable, counted from 0, or these frames of a sequence, "
     "for example 1-100x2")
    ("fps", value<double>()->value_name("F"),
     "pictures per second of a video (default: 30)");
  // clang-format on
}

void readCameraOptions(const Arguments& a, Options& options) {
  options.camera = cameraOf(a);
  options.turntable = turntableOf(a);
  readFrames(a, options);
  readFps(a, options);
  checkVideoOptions(a, options);
}

}  // namespace esvr::render
