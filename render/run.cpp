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
std::unique_ptr<Drawing> referenceOf(const Options& options, const DrawSettings& settings) {
  if (options.reference.empty()) return nullptr;
  DrawSettings own = settings;
  if (options.input.extension() != ".esvr") own.values.reset();
  return std::make_unique<Drawing>(readScenes(sceneFile(options, options.reference)), own);
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
  Frames(const Options& options, Drawing& drawing, Drawing* reference, const CancelToken& cancel)
      : options_(options),
        log_(kProgram, options.verbosity),
        drawing_(drawing),
        reference_(reference),
        bar_(barOf(options, drawing.scenes.front())) {
    if (report::isVideo(options.output))
      video_.emplace(options.output, videoForm(options, commandText()), cancel);
  }

  void draw(const RenderOptions& r, const PictureFiles& files) {
    cli::Stopwatch watch;
    const Image image = drawing_.renderer->draw(r);
    const double seconds = watch.lap();
    if (video_)
      video_->add(withBar(image)), ++pictures_;
    else
      keep(image, r, files, seconds);
    if (!files.depth.empty()) drawDepth(r, files.depth);
  }
  /// Completes a video.
  void finish() {
    if (!video_) return;
    video_->finish();
    log_.info(summary(options_.output, drawing_.scenes, options_.resolution, watch_.lap()) + ", " +
              std::to_string(pictures_) + " pictures, " +
              cli::shortNumber(pictures_ / options_.fps) + " s of video");
  }
  [[nodiscard]] const nlohmann::ordered_json& comparisons() const { return comparisons_; }

 private:
  void keep(const Image& image, const RenderOptions& r, const PictureFiles& files, double seconds) {
    write(files.picture, withBar(image), options_.background);
    log_.info(summary(files.picture, drawing_.scenes, r.resolution, seconds));
    if (reference_ != nullptr) compare(r, image, files);
  }

  /// The picture as it is shown; figures are measured without the color bar.
  [[nodiscard]] Image withBar(Image image) const {
    if (bar_) report::drawColorBar(*bar_, image);
    return image;
  }

  void drawDepth(RenderOptions r, const fs::path& file) {
    r.mode = RenderMode::kDepth;
    const auto bytes = encodeDepthExr(drawing_.renderer->draw(r), {software(), commandText()});
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
  Drawing& drawing_;
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

/// \param pivot  the point about which a turntable turns
void drawFrames(const Options& options, RenderOptions r, const Vec3& pivot, Frames& frames) {
  const Camera first = r.camera;
  for (const PictureFiles& files : pictureFiles(options)) {
    if (files.frame > 0) r.camera = turned(first, 360.0 * files.frame / options.turntable, pivot);
    frames.draw(r, files);
  }
  frames.finish();
}

void saveTransfer(const Options& options, const TransferFunction& transfer) {
  if (options.saveTransfer.empty()) return;
  const std::string text = paraViewPreset(transfer, options.saveTransfer.stem().string());
  cli::writeBytes(options.saveTransfer, std::as_bytes(std::span(text)), options.overwrite);
}

}  // namespace

void run(const Options& options) {
  const cli::Interrupts interrupts;
  checkFiles(options);
  checkPictureSize(options);
  const DrawSettings settings{selectDevice(options.device), options.limits, options.values,
                              options.shading.has_value(), options.memory};
  auto scenes = readScenes(sceneFile(options, options.input));
  RenderOptions r = renderOptions(options, scenes);
  Drawing drawing(std::move(scenes), settings);
  const auto reference = referenceOf(options, settings);
  r.cancel = &interrupts.token();
  saveTransfer(options, r.transfer);
  auto report = reportHead(options, settings.device);
  if (options.bench) {
    const cli::Log log(kProgram, options.verbosity);
    report.update(bench(
        {*drawing.renderer, reference ? &*reference->renderer : nullptr, options.referenceSamples},
        r, options.turntable, log));
  } else {
    Frames frames(options, drawing, reference.get(), interrupts.token());
    drawFrames(options, r, pivotOf(options, drawing.scenes), frames);
    report["comparisons"] = frames.comparisons();
  }
  writeReport(options, report);
}

}  // namespace esvr::render
