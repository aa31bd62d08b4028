#include "report/video_file.h"

#include <array>
#include <charconv>

#include "esvr/error.h"
#include "report/pixel_level.h"

namespace esvr::report {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWebm = ".webm";
constexpr const char* kMp4 = ".mp4";

using Words = std::vector<std::string>;

/// The codecs are those that browsers play. The numbers after -crf stand for a quality at which
/// errors are hardly visible.
Words codecOf(const fs::path& path) {
  if (path.extension() == kWebm)
    return {"-c:v", "libvpx-vp9", "-crf", "24",      "-b:v", "0",  "-deadline",
            "good", "-cpu-used",  "2",    "-row-mt", "1",    "-f", "webm"};
  return {"-c:v", "libx264", "-crf", "18", "-movflags", "+faststart", "-f", "mp4"};
}

std::string textOf(double number) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  return {text.data(), end};
}

Words inputOf(const VideoForm& form) {
  return {"-f",
          "rawvideo",
          "-pixel_format",
          "rgb24",
          "-video_size",
          std::to_string(form.width) + "x" + std::to_string(form.height),
          "-framerate",
          textOf(form.fps),
          "-i",
          "pipe:0"};
}

/// Pixels become the colors of BT.709, as most players assume, and the file says so. Halved
/// resolution of the colors is the form that all players read.
Words colors() {
  return {"-vf",
          "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p",
          "-colorspace",
          "bt709",
          "-color_primaries",
          "bt709",
          "-color_trc",
          "iec61966-2-1",
          "-color_range",
          "tv"};
}

Words argumentsOf(const VideoForm& form, const fs::path& path, const fs::path& temporary) {
  Words words{"-hide_banner", "-nostdin", "-loglevel", "error", "-y"};
  for (const Words& more :
       {inputOf(form), colors(), codecOf(path),
        Words{"-metadata", "comment=" + form.comment, "file:" + temporary.string()}})
    words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// The colors in front of the background, with three bytes a pixel.
std::vector<std::byte> pixelsOf(const Image& image, const std::array<double, 3>& background) {
  std::vector<std::byte> pixels;
  pixels.reserve(image.rgba.size() / 4 * 3);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4)
    for (std::size_t c = 0; c < background.size(); ++c) {
      const double behind = (1.0 - double(image.rgba[i + 3])) * background[c];
      pixels.push_back(std::byte(levelOf(double(image.rgba[i + c]) + behind)));
    }
  return pixels;
}

}  // namespace

bool isVideo(const fs::path& path) { return path.extension() == kMp4 || path.extension() == kWebm; }

fs::path findFfmpeg() {
  const auto found = findProgram("ffmpeg");
  if (!found)
    throw UsageError(
        "a video needs the program ffmpeg, which is not in PATH; install it "
        "(apt-get install ffmpeg), or write pictures");
  return *found;
}

void checkVideoSize(int width, int height) {
  if (width % 2 != 0 || height % 2 != 0)
    throw UsageError("a video needs an even width and an even height, not " +
                     std::to_string(width) + " x " + std::to_string(height));
}

VideoFile::VideoFile(fs::path path, const VideoForm& form, const CancelToken& cancel)
    : path_(std::move(path)),
      background_(form.background),
      file_(path_, form.overwrite),
      ffmpeg_(findFfmpeg(), argumentsOf(form, path_, file_.path()), cancel) {}

void VideoFile::add(const Image& image) {
  if (!ffmpeg_.write(pixelsOf(image, background_))) {
    checkEnd();
    fail("it ended before it had read all pictures");
  }
}

void VideoFile::finish() {
  checkEnd();
  if (fs::file_size(file_.path()) == 0) fail("it wrote nothing");
  file_.commit();
}

void VideoFile::checkEnd() {
  if (const auto why = ffmpeg_.finish()) fail(*why);
}

void VideoFile::fail(const std::string& why) const {
  throw RuntimeFailure("cannot write " + path_.string() + ": ffmpeg: " + why);
}

}  // namespace esvr::report
