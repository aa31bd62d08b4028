// esvr-render draws the ellipsoids of an .esvr file or the voxels of a VDB file: one picture, the
// pictures of a turntable, or the frames of a sequence.

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <span>
#include <system_error>
#include <vector>

#include "esvr/device.h"
#include "esvr/image_metrics.h"
#include "esvr/sequence_file.h"
#include "esvr/vdb_io.h"
#include "programs/command_line.h"
#include "programs/files.h"
#include "programs/resources.h"
#include "programs/run_main.h"
#include "programs/sequence.h"
#include "programs/video_file.h"
#include "render/image_files.h"
#include "render/look.h"
#include "render/options.h"
#include "render/scene.h"

namespace esvr::render {

namespace fs = std::filesystem;

// The names of the files.

namespace {

/// The files of one picture; an empty name stands for no file.
struct PictureFiles {
  int frame = 0;                  ///< number of the picture in a turn
  std::filesystem::path picture;  ///< empty for a video, which has no files for its pictures
  std::filesystem::path sheet, depth;
};

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

/// The file of a frame: the number replaces %d or %04d in the name, or comes before the extension.
/// "turn.png" becomes "turn.0007.png". A folder gets the file "frame.0007.png".
fs::path frameName(const fs::path& output, int frame) {
  constexpr std::size_t kDigits = 4;
  if (isFolder(output)) return frameName(output / "frame.png", frame);
  std::string pattern = output.filename().string();
  if (replacePattern(pattern, frame)) return output.parent_path() / pattern;
  fs::path name = output;
  return name.replace_extension(withDigits(frame, kDigits) + output.extension().string());
}

/// The file of a picture's error map: "turn.0007.error.png" for "turn.0007.png".
fs::path errorName(const fs::path& picture) {
  fs::path name = picture;
  return name.replace_extension("error" + picture.extension().string());
}

/// The files of a frame of a sequence, whose number replaces the pattern in the names.
PictureFiles filesOfFrame(const Options& options, cli::FrameNumber frame) {
  const auto at = [&](const fs::path& path) {
    const auto pattern = cli::FramePattern::in(path.string());
    return pattern ? pattern->at(frame) : fs::path{};
  };
  return {
      0, report::isVideo(options.output) ? fs::path{} : at(options.output), {}, at(options.depth)};
}

/// The files of all pictures that the options ask for.
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

void createFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    throw RuntimeFailure("cannot create the folder " + folder.string() + ": " + error.message());
}

void checkPictureFiles(const Options& options, const PictureFiles& files) {
  if (!files.picture.empty()) {
    cli::checkOutput(files.picture, {".png", ".exr"}, options.overwrite);
    if (!options.reference.empty())
      cli::checkOutput(errorName(files.picture), {".png", ".exr"}, options.overwrite);
  }
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

/// Checks all files before anything is drawn, so that a mistake costs no time. A folder for a
/// turntable whose name ends in '/' is created.
/// \throws UsageError, RuntimeFailure  a file has a wrong name or cannot be written; a video cannot
///                                     be made
void checkFiles(const Options& options) {
  if (options.turntable != 0 && endsInSlash(options.output)) createFolder(options.output);
  cli::requireSeparate(options.inputs.paths, allOutputs(options));
  if (report::isVideo(options.output)) {
    cli::checkOutput(options.output, {".mp4", ".webm"}, options.overwrite);
    report::checkVideoSize(options.resolution.width, options.resolution.height);
    (void)report::findFfmpeg();
  }
  if (!options.bench)
    for (const PictureFiles& files : pictureFiles(options)) checkPictureFiles(options, files);
  if (!options.saveTransfer.empty())
    cli::checkOutput(options.saveTransfer, {".json"}, options.overwrite);
  const bool toFile = !options.report.empty() && options.report != cli::kStandardOutput;
  if (toFile) cli::checkOutput(options.report, {".json"}, options.overwrite);
}

}  // namespace

// Pictures.

namespace {

/// Grids of a file together with their renderer.
struct Drawing {
  Drawing(std::vector<Scene> from, const DrawSettings& settings)
      : scenes(std::move(from)), renderer(scenes, settings) {}

  const std::vector<Scene> scenes;
  SceneRenderer renderer;
};

/// The grids of a file that the options name.
SceneFile sceneFile(const Options& options, const fs::path& path) {
  SceneFile file{path, options.grid, {}, options.memory};
  for (const FurtherGrid& grid : options.with) file.with.push_back(grid.name);
  return file;
}

/// The drawing of --ref. If the input is a VDB file, --values applies to the input alone.
/// \param drawn  the grid of the input, which is also drawn of the reference if it has a grid of
/// this name
std::unique_ptr<Drawing> referenceOf(const Options& options, const std::string& drawn,
                                     const DrawSettings& settings) {
  if (options.reference.empty()) return nullptr;
  DrawSettings own = settings;
  if (options.input.extension() != ".esvr") own.values.reset();
  SceneFile file = sceneFile(options, options.reference);
  if (!file.grid) file.preferred = drawn;
  return std::make_unique<Drawing>(readScenes(file), own);
}

std::string summary(const fs::path& file, const std::vector<Scene>& scenes, Resolution r,
                    double seconds) {
  std::string grids = scenes.front().grid;
  for (std::size_t i = 1; i < scenes.size(); ++i) grids += " + " + scenes[i].grid;
  return file.string() + ": " + grids + ", " + std::to_string(r.width) + " x " +
         std::to_string(r.height) + ", " + cli::shortNumber(seconds) + " s";
}

/// The form of the video that the options ask for.
report::VideoForm videoForm(const Options& options, const std::string& comment) {
  const Rgb behind = options.background.value_or(Rgb{});
  report::VideoForm form;
  form.width = options.resolution.width;
  form.height = options.resolution.height;
  form.fps = options.fps;
  form.background = {behind.r, behind.g, behind.b};
  form.comment = comment;
  form.overwrite = options.overwrite;
  return form;
}

/// Draws pictures and writes them to files or to a video.
class Frames {
 public:
  /// \param scenes  grids of all pictures
  Frames(const Options& options, const std::vector<Scene>& scenes, Drawing* reference,
         const CancelToken& cancel)
      : options_(options),
        log_(kProgram, options.verbosity),
        scenes_(scenes),
        reference_(reference),
        bar_(barOf(options, scenes.front())) {
    if (report::isVideo(options.output))
      video_.emplace(options.output, videoForm(options, commandText()), cancel);
  }

  void draw(Drawing& drawing, const RenderOptions& r, const PictureFiles& files) {
    cli::Stopwatch watch;
    const Image image = drawing.renderer->draw(r);
    show(image, r, files, watch.lap());
    if (!files.depth.empty()) writeDepth(depthOf(drawing, r), files.depth);
    ++complete_;
  }

  /// Draws a frame in which nothing is active: it is transparent, and has no file of distances.
  void drawNothing(const RenderOptions& r, const PictureFiles& files) {
    constexpr std::size_t kChannels = 4;
    Image image{r.resolution.width, r.resolution.height, {}};
    image.rgba.resize(std::size_t(image.width) * std::size_t(image.height) * kChannels);
    show(image, r, files, 0.0);
    ++complete_;
  }

  /// Completes a video.
  void finish() {
    if (!video_) return;
    video_->finish();
    log_.info(summary(options_.output, scenes_, options_.resolution, watch_.lap()) + ", " +
              std::to_string(pictures_) + " pictures, " +
              cli::shortNumber(pictures_ / options_.fps) + " s of video");
  }
  [[nodiscard]] const nlohmann::ordered_json& comparisons() const { return comparisons_; }

  /// What an interruption leaves: the pictures that are complete, or nothing of a video.
  /// \throws RuntimeFailure  it leaves something
  void tellInterruption(std::size_t all) const {
    if (video_ || complete_ == 0) return;
    throw RuntimeFailure("interrupted; " + cli::completeOf(complete_, all, "picture"));
  }

 private:
  void show(const Image& image, const RenderOptions& r, const PictureFiles& files, double seconds) {
    if (video_)
      video_->add(withBar(image)), ++pictures_;
    else
      keep(image, r, files, seconds);
  }

  void keep(const Image& image, const RenderOptions& r, const PictureFiles& files, double seconds) {
    write(files.picture, withBar(image), options_.background);
    log_.info(summary(files.picture, scenes_, r.resolution, seconds));
    if (reference_ != nullptr) compare(r, image, files);
  }

  /// The picture as it is shown; figures are measured without the color bar.
  [[nodiscard]] Image withBar(Image image) const {
    if (bar_) report::drawColorBar(*bar_, image);
    return image;
  }

  static Image depthOf(Drawing& drawing, RenderOptions r) {
    r.mode = RenderMode::kDepth;
    return drawing.renderer->draw(r);
  }

  void writeDepth(const Image& depth, const fs::path& file) {
    const auto bytes = encodeDepthExr(depth, {software(), commandText()});
    cli::writeBytes(file, bytes, options_.overwrite);
    log_.info(file.string() + ": distances in voxels");
  }

  void write(const fs::path& file, const Image& image, const std::optional<Rgb>& background) {
    const auto bytes = file.extension() == ".exr" ? encodeExr(image, {software(), commandText()})
                                                  : encodePng(image, {background, options_.bits},
                                                              {software(), commandText()});
    cli::writeBytes(file, bytes, options_.overwrite);
  }

  /// The command line in one text, with the program's name instead of its path.
  [[nodiscard]] std::string commandText() const {
    std::string text = kProgram;
    for (std::size_t i = 1; i < options_.commandLine.size(); ++i)
      text += " " + options_.commandLine[i];
    return text;
  }

  static std::string software() { return std::string(kProgram) + " " + cli::programVersion(); }

  void compare(const RenderOptions& r, const Image& image, const PictureFiles& files) {
    constexpr double kGain = 10.0;  // gain of the difference; --help states it
    const Image expected = drawSupersampled(*reference_->renderer, r, options_.referenceSamples);
    const ImageMetrics m = compareImages(expected, image);
    const Image error = errorMap(expected, image, kGain);
    write(errorName(files.picture), error, std::nullopt);
    if (!files.sheet.empty())
      write(files.sheet, sideBySide(std::array{withBar(image), expected, error}),
            options_.background);
    log_.info(errorName(files.picture).string() + ": PSNR " + cli::shortNumber(m.psnr) +
              " dB, SSIM " + cli::shortNumber(m.ssim) + ", largest error " +
              cli::shortNumber(m.maxError));
    comparisons_.push_back({{"picture", files.picture.string()},
                            {"psnr", jsonNumber(m.psnr)},
                            {"ssim", m.ssim},
                            {"max_error", m.maxError}});
  }

  const Options& options_;
  const cli::Log log_;
  const std::vector<Scene>& scenes_;
  Drawing* reference_;
  const std::optional<report::ColorBar> bar_;
  std::optional<report::VideoFile> video_;
  int pictures_ = 0;          ///< pictures of the video
  std::size_t complete_ = 0;  ///< pictures of which all files are there
  cli::Stopwatch watch_;
  nlohmann::ordered_json comparisons_ = nlohmann::ordered_json::array();
};

}  // namespace

// Sequences.

namespace {

/// The frames of the input: in one file, or a file each.
class InputFrames {
 public:
  explicit InputFrames(const Options& options)
      : options_(options), file_(sceneFile(options, options.input)) {
    if (options.pattern) return;
    ReadLimits limits{options.memory.maxBytes, options.memory.voxels};
    limits.carriedBytes = false;
    reader_.emplace(options.input, limits);
  }

  /// The grids of a frame; nothing if it has nothing active to draw.
  std::optional<std::vector<Scene>> scenes(cli::FrameNumber frame) {
    if (reader_) return scenesOf(reader_->read(frame), file_);
    return place(frame) ? readFrame(file_) : std::nullopt;
  }
  /// The same without their content. \param measures  as for outlinesOf
  std::optional<std::vector<Scene>> outlines(cli::FrameNumber frame, bool measures) {
    if (reader_) return outlinesOf(reader_->read(frame), file_, measures);
    return place(frame) ? readFrameOutlines(file_, measures) : std::nullopt;
  }

 private:
  /// Sets the file of a frame. Unless the options name a grid, all frames of .vdb files draw the
  /// grid of one name, which is the first that can be drawn in any of them.
  /// \return false if the frame does not have this grid
  bool place(cli::FrameNumber frame) {
    file_.path = options_.pattern->toRead(frame);
    if (options_.grid || file_.path.extension() == ".esvr") return true;
    if (!file_.grid) file_.grid = firstDrawable(file_.path);
    if (!file_.grid) return false;
    return std::ranges::any_of(inspectVdb(file_.path).grids, [&](const GridSummary& grid) {
      return grid.uniqueName == *file_.grid;
    });
  }

  const Options& options_;
  SceneFile file_;
  std::optional<SequenceReader> reader_;
};

/// Scenes that enclose those of all frames, so that camera and transfer functions do not change
/// from frame to frame.
std::vector<Scene> scenesOfAll(const Options& options, InputFrames& input) {
  std::optional<std::vector<Scene>> all;
  for (const cli::FrameNumber frame : *options.frames) {
    auto scenes = input.outlines(frame, !all);
    if (scenes && all) enclose(*scenes, *all);
    if (!all) all = std::move(scenes);
  }
  if (!all) throw BadInput(options.input.string() + ": no frame has anything active to draw");
  return std::move(*all);
}

}  // namespace

// The program.

namespace {

constexpr const char* kReportSchema = "esvr-picture";
constexpr int kReportVersion = 1;

/// Checks the memory for pictures. Each is held as four floats a pixel and is encoded in memory.
/// With --ref there are also the reference's picture, the difference and, with --sheet, the sheet.
void checkPictureSize(const Options& options) {
  constexpr double kBytesPerPixel = 48.0;
  const double more = double(options.referenceSamples) * options.referenceSamples - 1.0;
  const double pictures =
      options.reference.empty() ? 1.0 : (options.sheet.empty() ? 3.0 : 6.0) + more;
  const Resolution r = options.resolution;
  requireWithinMemory(
      pictures * kBytesPerPixel * r.width * r.height, options.memory.maxBytes,
      "a picture of " + std::to_string(r.width) + " x " + std::to_string(r.height) + " pixels");
}

nlohmann::ordered_json reportHead(const Options& options, const Device& device) {
  return {{"schema", kReportSchema},
          {"schema_version", kReportVersion},
          {"program", kProgram},
          {"command_line", options.commandLine},
          {"versions", {{"esvr", cli::programVersion()}}},
          {"device", deviceName(device)},
          {"input", options.input.string()}};
}

/// Warns that a transform is not applied.
void reportTransform(const Options& options, const std::vector<Scene>& scenes) {
  if (voxelShape(scenes.front().transform.affine)) return;
  cli::Log(kProgram, options.verbosity)
      .warning(
          options.input.string() + ", " + scenes.front().grid +
          ": its transform is a frustum or has no inverse, and is not applied; voxels are drawn "
          "as cubes");
}

/// Warns of values and ellipsoids for which float32 has few digits or none.
void reportPrecision(const Options& options, const std::vector<Scene>& scenes) {
  for (const Scene& scene : scenes) {
    if (scene.encoded)
      if (const std::string why = whyImprecise(*scene.encoded); !why.empty())
        cli::Log(kProgram, options.verbosity)
            .warning(options.input.string() + ", " + scene.grid + ": " + why);
    const float largest = std::max(std::abs(scene.data.min), std::abs(scene.data.max));
    if (largest == 0.0f || largest >= std::numeric_limits<float>::min()) continue;
    cli::Log(kProgram, options.verbosity)
        .warning(options.input.string() + ", " + scene.grid +
                 ": its values are below 1.2e-38, and pictures do not tell them apart");
  }
}

/// Warns that nothing is left by --clip or --slice, whose places may be those of another grid.
void reportCut(const Options& options, const std::vector<Scene>& scenes) {
  if (!options.clip) return;
  const auto isCutOff = [&clip = *options.clip](const Scene& scene) {
    const Coord low = scene.box.min, high = scene.box.max;
    // A voxel is drawn up to its neighbours.
    const auto misses = [&](std::size_t axis, int first, int last) {
      return clip.low[axis] >= last + 1.0 || clip.high[axis] <= first - 1.0;
    };
    return misses(0, low.x, high.x) || misses(1, low.y, high.y) || misses(2, low.z, high.z);
  };
  if (!std::ranges::all_of(scenes, isCutOff)) return;
  cli::Log(kProgram, options.verbosity)
      .warning(
          options.input.string() + ", " + scenes.front().grid +
          ": nothing active is drawn; --clip and --slice leave a box outside its active voxels, " +
          cli::textOf(scenes.front().box));
}

/// Warns that --between sum has no effect on a grid. \return whether it has none
bool reportBetween(const Options& options, const std::vector<Scene>& scenes) {
  if (options.between != Between::kSum || hasSum(scenes.front())) return false;
  cli::Log(kProgram, options.verbosity)
      .warning(
          options.input.string() + ", " + scenes.front().grid +
          ": it is no sum of ellipsoids alone, so that its voxels are drawn; --between sum has no "
          "effect");
  return true;
}

void saveTransfer(const Options& options, const TransferFunction& transfer) {
  if (options.saveTransfer.empty()) return;
  const std::string text = paraViewPreset(transfer, options.saveTransfer.stem().string());
  cli::writeBytes(options.saveTransfer, std::as_bytes(std::span(text)), options.overwrite);
}

void drawFrames(const Options& options, RenderOptions r, Drawing& drawing, Frames& frames) {
  const Vec3 pivot = pivotOf(options, drawing.scenes);  // of a turntable
  const Camera first = r.camera;
  const std::vector<PictureFiles> pictures = pictureFiles(options);
  try {
    for (const PictureFiles& files : pictures) {
      if (files.frame > 0) r.camera = turned(first, 360.0 * files.frame / options.turntable, pivot);
      frames.draw(drawing, r, files);
    }
    frames.finish();
  } catch (const Cancelled&) {
    frames.tellInterruption(pictures.size());
    throw;
  }
}

void drawSequence(const Options& options, const DrawSettings& settings, const CancelToken& cancel) {
  if (!options.frameHint.empty())
    cli::Log(kProgram, options.verbosity)
        .warning(options.input.string() + ": " + options.frameHint);
  InputFrames input(options);
  const auto all = scenesOfAll(options, input);
  reportTransform(options, all);
  reportPrecision(options, all);
  reportCut(options, all);
  RenderOptions r = renderOptions(options, all);
  r.cancel = &cancel;
  saveTransfer(options, r.transfer);
  Frames frames(options, all, nullptr, cancel);
  bool isReported = false;  // one warning for all frames
  const auto drawFrame = [&](cli::FrameNumber frame) {
    const PictureFiles files = filesOfFrame(options, frame);
    auto scenes = input.scenes(frame);
    if (!scenes) return frames.drawNothing(r, files);
    isReported = isReported || reportBetween(options, *scenes);
    Drawing drawing(std::move(*scenes), settings);
    frames.draw(drawing, r, files);
  };
  try {
    for (const cli::FrameNumber frame : *options.frames) drawFrame(frame);
    frames.finish();
  } catch (const Cancelled&) {
    frames.tellInterruption(options.frames->size());
    throw;
  }
}

/// Carries out the options. \throws Error
void run(const Options& options) {
  const cli::Interrupts interrupts;
  checkFiles(options);
  checkPictureSize(options);
  const DrawSettings settings{
      selectDevice(options.device), options.limits, options.values,
      options.shading.has_value(),  options.memory, options.between == Between::kSum};
  if (options.frames) return drawSequence(options, settings, interrupts.token());
  auto scenes = readScenes(sceneFile(options, options.input));
  reportTransform(options, scenes);
  reportPrecision(options, scenes);
  reportCut(options, scenes);
  (void)reportBetween(options, scenes);
  RenderOptions r = renderOptions(options, scenes);
  Drawing drawing(std::move(scenes), settings);
  const auto reference = referenceOf(options, drawing.scenes.front().grid, settings);
  r.cancel = &interrupts.token();
  saveTransfer(options, r.transfer);
  auto report = reportHead(options, settings.device);
  if (options.bench) {
    const cli::Log log(kProgram, options.verbosity);
    report.update(bench(
        {*drawing.renderer, reference ? &*reference->renderer : nullptr, options.referenceSamples},
        r, options.turntable, log));
  } else {
    Frames frames(options, drawing.scenes, reference.get(), interrupts.token());
    drawFrames(options, r, drawing, frames);
    report["comparisons"] = frames.comparisons();
  }
  if (!options.report.empty()) cli::writeJson({options.report, options.overwrite}, report);
}

}  // namespace

}  // namespace esvr::render

int main(int argc, char** argv) {
  using namespace esvr;
  return cli::runMain(render::kProgram, [&] {
    const auto options = render::parseOptions(argc, argv);
    if (!options) return 0;
    const cli::ThreadLimit threads(options->threads);
    render::run(*options);
    return 0;
  });
}
