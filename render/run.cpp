#include "render/run.h"

#include <algorithm>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "cli/bytes_file.h"
#include "cli/interrupts.h"
#include "cli/json_file.h"
#include "cli/stopwatch.h"
#include "cli/table.h"
#include "cli/version_text.h"
#include "esvr/image_metrics.h"
#include "esvr/memory_limit.h"
#include "esvr/sequence_file.h"
#include "esvr/vdb_io.h"
#include "render/bench.h"
#include "render/exr_file.h"
#include "render/output_files.h"
#include "render/png_file.h"
#include "render/render_options.h"
#include "render/scene.h"
#include "render/supersample.h"
#include "report/video_file.h"

namespace esvr::render {
namespace {

namespace fs = std::filesystem;

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
/// \param drawn  the grid of the input, which is also drawn of the reference if it has a grid of this name
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
  }

  /// Draws a frame in which nothing is active: it is transparent, and has no file of distances.
  void drawNothing(const RenderOptions& r, const PictureFiles& files) {
    constexpr std::size_t kChannels = 4;
    Image image{r.resolution.width, r.resolution.height, {}};
    image.rgba.resize(std::size_t(image.width) * std::size_t(image.height) * kChannels);
    show(image, r, files, 0.0);
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
  int pictures_ = 0;  ///< pictures of the video
  cli::Stopwatch watch_;
  nlohmann::ordered_json comparisons_ = nlohmann::ordered_json::array();
};

nlohmann::ordered_json reportHead(const Options& options, const Device& device) {
  return {{"schema", kReportSchema},
          {"schema_version", kReportVersion},
          {"program", kProgram},
          {"command_line", options.commandLine},
          {"versions", {{"esvr", cli::programVersion()}}},
          {"device", deviceName(device)},
          {"input", options.input.string()}};
}

void writeReport(const Options& options, const nlohmann::ordered_json& report) {
  if (!options.report.empty()) cli::writeJson({options.report, options.overwrite}, report);
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

void drawFrames(const Options& options, RenderOptions r, Drawing& drawing, Frames& frames) {
  const Vec3 pivot = pivotOf(options, drawing.scenes);  // of a turntable
  const Camera first = r.camera;
  for (const PictureFiles& files : pictureFiles(options)) {
    if (files.frame > 0) r.camera = turned(first, 360.0 * files.frame / options.turntable, pivot);
    frames.draw(drawing, r, files);
  }
  frames.finish();
}

void saveTransfer(const Options& options, const TransferFunction& transfer) {
  if (options.saveTransfer.empty()) return;
  const std::string text = paraViewPreset(transfer, options.saveTransfer.stem().string());
  cli::writeBytes(options.saveTransfer, std::as_bytes(std::span(text)), options.overwrite);
}

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
  /// The same without their content.
  std::optional<std::vector<Scene>> outlines(cli::FrameNumber frame) {
    if (reader_) return outlinesOf(reader_->read(frame), file_);
    return place(frame) ? readFrameOutlines(file_) : std::nullopt;
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

/// Scenes that enclose those of all frames, so that camera and transfer functions do not change from
/// frame to frame.
std::vector<Scene> scenesOfAll(const Options& options, InputFrames& input) {
  std::optional<std::vector<Scene>> all;
  for (const cli::FrameNumber frame : *options.frames) {
    auto scenes = input.outlines(frame);
    if (scenes && all) enclose(*scenes, *all);
    if (!all) all = std::move(scenes);
  }
  if (!all) throw BadInput(options.input.string() + ": no frame has anything active to draw");
  return std::move(*all);
}

void drawSequence(const Options& options, const DrawSettings& settings, const CancelToken& cancel) {
  if (!options.frameHint.empty())
    cli::Log(kProgram, options.verbosity)
        .warning(options.input.string() + ": " + options.frameHint);
  InputFrames input(options);
  const auto all = scenesOfAll(options, input);
  reportTransform(options, all);
  RenderOptions r = renderOptions(options, all);
  r.cancel = &cancel;
  saveTransfer(options, r.transfer);
  Frames frames(options, all, nullptr, cancel);
  for (const cli::FrameNumber frame : *options.frames) {
    const PictureFiles files = filesOfFrame(options, frame);
    auto scenes = input.scenes(frame);
    if (!scenes) {
      frames.drawNothing(r, files);
      continue;
    }
    Drawing drawing(std::move(*scenes), settings);
    frames.draw(drawing, r, files);
  }
  frames.finish();
}

}  // namespace

void run(const Options& options) {
  const cli::Interrupts interrupts;
  checkFiles(options);
  checkPictureSize(options);
  const DrawSettings settings{selectDevice(options.device), options.limits, options.values,
                              options.shading.has_value(), options.memory};
  if (options.frames) return drawSequence(options, settings, interrupts.token());
  auto scenes = readScenes(sceneFile(options, options.input));
  reportTransform(options, scenes);
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
  writeReport(options, report);
}

}  // namespace esvr::render
