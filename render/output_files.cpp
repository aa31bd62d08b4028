#include "render/output_files.h"

#include <algorithm>
#include <regex>
#include <system_error>

#include "cli/frame_pattern.h"
#include "cli/json_file.h"
#include "cli/output.h"
#include "report/video_file.h"

namespace esvr::render {
namespace {

namespace fs = std::filesystem;

std::string withDigits(int number, std::size_t digits) {
  std::string text = std::to_string(number);
  text.insert(0, digits - std::min(digits, text.size()), '0');
  return text;
}

/// Replaces %d or %04d by a number. \return false if the name has neither
bool replacePattern(std::string& name, int number) {
  static const std::regex kPattern("%(?:0([1-9]))?d");
  std::smatch found;
  if (!std::regex_search(name, found, kPattern)) return false;
  const std::size_t digits = found[1].matched ? std::size_t(std::stoi(found[1])) : 1;
  name = found.prefix().str() + withDigits(number, digits) + found.suffix().str();
  return true;
}

bool endsInSlash(const fs::path& path) { return !path.empty() && !path.has_filename(); }

bool isFolder(const fs::path& path) {
  std::error_code missing;
  return endsInSlash(path) || (!path.empty() && fs::is_directory(path, missing));
}

void createFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    throw RuntimeFailure("cannot create the folder " + folder.string() + ": " + error.message());
}

void checkPicture(const Options& options, const fs::path& file) {
  cli::checkOutput(file, {".png", ".exr"}, options.overwrite);
  if (options.reference.empty()) return;
  cli::checkOutput(errorName(file), {".png", ".exr"}, options.overwrite);
}

void checkPictureFiles(const Options& options, const PictureFiles& files) {
  if (!files.picture.empty()) checkPicture(options, files.picture);
  if (!files.depth.empty()) cli::checkOutput(files.depth, {".exr"}, options.overwrite);
  if (!files.sheet.empty()) cli::checkOutput(files.sheet, {".png"}, options.overwrite);
}

/// All files that the run writes.
std::vector<fs::path> allOutputs(const Options& options) {
  std::vector<fs::path> outputs{options.saveTransfer, options.report};
  if (report::isVideo(options.output)) outputs.push_back(options.output);
  if (options.bench) return outputs;
  for (const PictureFiles& files : pictureFiles(options)) {
    outputs.insert(outputs.end(), {files.picture, files.depth, files.sheet});
    if (!options.reference.empty() && !files.picture.empty())
      outputs.push_back(errorName(files.picture));
  }
  return outputs;
}

void checkVideo(const Options& options) {
  cli::checkOutput(options.output, {".mp4", ".webm"}, options.overwrite);
  report::checkVideoSize(options.resolution.width, options.resolution.height);
  (void)report::findFfmpeg();
}

}  // namespace

fs::path frameName(const fs::path& output, int frame) {
  constexpr std::size_t kDigits = 4;
  if (isFolder(output)) return frameName(output / "frame.png", frame);
  std::string pattern = output.filename().string();
  if (replacePattern(pattern, frame)) return output.parent_path() / pattern;
  fs::path name = output;
  return name.replace_extension(withDigits(frame, kDigits) + output.extension().string());
}

fs::path errorName(const fs::path& picture) {
  fs::path name = picture;
  return name.replace_extension("error" + picture.extension().string());
}

PictureFiles filesOfFrame(const Options& options, cli::FrameNumber frame) {
  const auto at = [&](const fs::path& path) {
    const auto pattern = cli::FramePattern::in(path.string());
    return pattern ? pattern->at(frame) : fs::path{};
  };
  return {
      0, report::isVideo(options.output) ? fs::path{} : at(options.output), {}, at(options.depth)};
}

std::vector<PictureFiles> pictureFiles(const Options& options) {
  const bool video = report::isVideo(options.output);
  if (options.frames) {
    std::vector<PictureFiles> files;
    for (const cli::FrameNumber frame : *options.frames)
      files.push_back(filesOfFrame(options, frame));
    return files;
  }
  if (options.turntable == 0) return {{0, options.output, options.sheet, options.depth}};
  const auto named = [](const fs::path& path, int frame) {
    return path.empty() ? path : frameName(path, frame);
  };
  std::vector<PictureFiles> files;
  const int last = options.lastFrame.value_or(options.turntable - 1);
  for (int i = options.firstFrame; i <= last; ++i)
    files.push_back({i, video ? fs::path{} : frameName(options.output, i), named(options.sheet, i),
                     named(options.depth, i)});
  return files;
}

void checkFiles(const Options& options) {
  if (options.turntable != 0 && endsInSlash(options.output)) createFolder(options.output);
  cli::requireSeparate(options.inputs.paths, allOutputs(options));
  if (report::isVideo(options.output)) checkVideo(options);
  if (!options.bench)
    for (const PictureFiles& files : pictureFiles(options)) checkPictureFiles(options, files);
  if (!options.saveTransfer.empty())
    cli::checkOutput(options.saveTransfer, {".json"}, options.overwrite);
  const bool toFile = !options.report.empty() && options.report != cli::kStandardOutput;
  if (toFile) cli::checkOutput(options.report, {".json"}, options.overwrite);
}

}  // namespace esvr::render
