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
#include "render/bench.h"
#include "render/exr_file.h"
#include "render/legend.h"
#include "render/output_files.h"
#include "render/png_file.h"
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

ValueRange rangeOf(const Options& options, const Scene& scene) {
  if (options.rangeKind == RangeKind::kGiven) return options.range;
  if (options.rangeKind == RangeKind::kData) return scene.data;
  return {std::min(scene.data.min, scene.background), std::max(scene.data.max, scene.background)};
}

/// The transfer function over its range. A level set is drawn as an opaque body unless an option
/// asks for another function or range.
TransferFunction transferOf(const Options& options, const Scene& scene) {
  const bool usual = !options.transfer && options.rangeKind == RangeKind::kAuto;
  const bool composite = options.mode == RenderMode::kComposite;
  if (usual && composite && scene.isLevelSet && scene.background > 0.0f)
    return levelSetSurface(double(scene.background));
  const TransferFunction function = options.transfer.value_or(
      TransferFunction{builtInColorMap(kUsualColors), builtInOpacity(kUsualOpacity)});
  if (options.rangeKind == RangeKind::kOwn) return function;
  return rescaled(function, rangeOf(options, scene));
}

/// The rule between voxels unless --between was given.
Between usualBetween(const Scene& scene) {
  const auto* field = std::get_if<Field>(&scene.content);
  return field ? fittedBetween(*field) : Between::kVoxels;
}

/// Benchmarks use the sphere around the volume, so that their figures are those of earlier versions.
Framing framingOf(const Options& options) {
  if (options.bench) return Framing::kSphere;
  return options.turntable == 0 ? Framing::kBox : Framing::kTurn;
}

/// The color bar that is drawn into pictures; nothing without --legend.
std::optional<report::ColorBar> barOf(const Options& options, const Scene& scene) {
  if (!options.legend) return std::nullopt;
  return legendOf(options, scene, transferOf(options, scene));
}

/// The camera; if it is fitted, the volume lies beside the color bar.
Camera cameraOf(const Options& options, const Scene& scene) {
  const Resolution r = options.resolution;
  CameraWish wish = options.camera;
  wish.framing = framingOf(options);
  if (const auto bar = barOf(options, scene))
    wish.freeRight = report::colorBarShare(*bar, r.width, r.height);
  return fitCamera(scene.box, wish, r);
}

RenderOptions renderOptions(const Options& options, const Scene& scene) {
  RenderOptions r;
  r.resolution = options.resolution;
  r.camera = cameraOf(options, scene);
  r.transfer = transferOf(options, scene);
  r.step = options.step;
  r.opacityLength = options.opacityLength;
  r.minTransmittance = options.minTransmittance.value_or(r.minTransmittance);
  r.mode = options.mode;
  r.classification = options.classification;
  r.lod = options.lod;
  r.shading = options.shading;
  r.between = options.between.value_or(usualBetween(scene));
  r.clip = options.clip;
  return r;
}

/// The scene of a file together with its renderer.
struct Drawing {
  Drawing(Scene from, const DrawSettings& settings)
      : scene(std::move(from)), renderer(scene, settings) {}

  const Scene scene;
  SceneRenderer renderer;
};

/// The drawing of --ref. If the input is a VDB file, --values applies to the input alone.
std::unique_ptr<Drawing> referenceOf(const Options& options, const DrawSettings& settings) {
  if (options.reference.empty()) return nullptr;
  DrawSettings own = settings;
  if (options.input.extension() != ".esvr") own.values.reset();
  return std::make_unique<Drawing>(readScene({options.reference, std::nullopt, options.memory}),
                                   own);
}

std::string summary(const fs::path& file, const Scene& scene, Resolution r, double seconds) {
  return file.string() + ": " + scene.grid + ", " + std::to_string(r.width) + " x " +
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
  /// \param scene  of all pictures
  Frames(const Options& options, const Scene& scene, Drawing* reference, const CancelToken& cancel)
      : options_(options),
        log_(kProgram, options.verbosity),
        scene_(scene),
        reference_(reference),
        bar_(barOf(options, scene)) {
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
    log_.info(summary(options_.output, scene_, options_.resolution, watch_.lap()) + ", " +
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
    log_.info(summary(files.picture, scene_, r.resolution, seconds));
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
  const Scene& scene_;
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

void drawFrames(const Options& options, RenderOptions r, Drawing& drawing, Frames& frames) {
  const Vec3 pivot = pivotOf(drawing.scene.box, options.camera);  // of a turntable
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

/// A scene that encloses those of all frames, so that camera and transfer function do not change
/// from frame to frame.
Scene sceneOfAll(const Options& options, const SceneFile& file, SequenceReader& reader) {
  std::optional<Scene> all;
  for (const cli::FrameNumber frame : *options.frames) {
    auto scene = outlineOf(reader.read(frame), file);
    if (scene && all) enclose(*scene, *all);
    if (!all) all = std::move(scene);
  }
  if (!all) throw BadInput(options.input.string() + ": no frame has anything active to draw");
  return std::move(*all);
}

void drawSequence(const Options& options, const DrawSettings& settings, const CancelToken& cancel) {
  const SceneFile file{options.input, options.grid, options.memory};
  ReadLimits limits{options.memory.maxBytes, options.memory.voxels};
  limits.carriedBytes = false;
  SequenceReader reader(options.input, limits);
  const Scene all = sceneOfAll(options, file, reader);
  RenderOptions r = renderOptions(options, all);
  r.cancel = &cancel;
  saveTransfer(options, r.transfer);
  Frames frames(options, all, nullptr, cancel);
  for (const cli::FrameNumber frame : *options.frames) {
    const PictureFiles files = filesOfFrame(options, frame);
    auto scene = sceneOf(reader.read(frame), file);
    if (!scene) {
      frames.drawNothing(r, files);
      continue;
    }
    Drawing drawing(std::move(*scene), settings);
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
  Scene scene = readScene({options.input, options.grid, options.memory});
  RenderOptions r = renderOptions(options, scene);
  Drawing drawing(std::move(scene), settings);
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
    Frames frames(options, drawing.scene, reference.get(), interrupts.token());
    drawFrames(options, r, drawing, frames);
    report["comparisons"] = frames.comparisons();
  }
  writeReport(options, report);
}

}  // namespace esvr::render
