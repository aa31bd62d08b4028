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
#include "cli/output.h"
#include "cli/stopwatch.h"
#include "cli/table.h"
#include "cli/version_text.h"
#include "esvr/image_metrics.h"
#include "esvr/memory_limit.h"
#include "render/bench.h"
#include "render/exr_file.h"
#include "render/png_file.h"
#include "render/scene.h"

namespace esvr::render {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReportSchema = "esvr-picture";
constexpr int kReportVersion = 1;

/// The file name of a frame: "turn.0007.png" for "turn.png" and 7.
fs::path frameName(const fs::path& output, int frame) {
  constexpr std::size_t kDigits = 4;
  std::string number = std::to_string(frame);
  number.insert(0, kDigits - std::min(kDigits, number.size()), '0');
  fs::path name = output;
  return name.replace_extension(number + output.extension().string());
}

std::vector<fs::path> frameNames(const Options& options, const fs::path& output) {
  std::vector<fs::path> names;
  const int last = options.lastFrame.value_or(options.turntable - 1);
  for (int i = options.firstFrame; i <= last; ++i) names.push_back(frameName(output, i));
  return names;
}

std::vector<fs::path> outputs(const Options& options) {
  if (options.turntable == 0) return {options.output};
  return frameNames(options, options.output);
}

std::vector<fs::path> sheetOutputs(const Options& options) {
  if (options.sheet.empty()) return {};
  if (options.turntable == 0) return {options.sheet};
  return frameNames(options, options.sheet);
}

std::vector<fs::path> depthOutputs(const Options& options) {
  if (options.depth.empty()) return {};
  if (options.turntable == 0) return {options.depth};
  return frameNames(options, options.depth);
}

/// The file name of a picture's error map: "turn.0007.error.png" for "turn.0007.png".
fs::path errorName(const fs::path& picture) {
  fs::path name = picture;
  return name.replace_extension("error" + picture.extension().string());
}

/// Checks all output files before anything is drawn, so that a mistake costs no time.
void checkFiles(const Options& options, const std::vector<fs::path>& files) {
  for (const auto& file : files) {
    cli::requireDistinct({options.input, file});
    cli::checkOutput(file, {".png", ".exr"}, options.overwrite);
    if (options.reference.empty()) continue;
    cli::requireDistinct({options.reference, file, errorName(file)});
    cli::checkOutput(errorName(file), {".png", ".exr"}, options.overwrite);
  }
  for (const auto& file : depthOutputs(options)) {
    cli::requireDistinct({options.input, file});
    cli::checkOutput(file, {".exr"}, options.overwrite);
  }
  for (const auto& file : sheetOutputs(options)) {
    cli::requireDistinct({options.input, options.reference, file});
    cli::checkOutput(file, {".png"}, options.overwrite);
  }
  if (!options.saveTransfer.empty())
    cli::checkOutput(options.saveTransfer, {".json"}, options.overwrite);
  const bool toFile = !options.report.empty() && options.report != cli::kStandardOutput;
  if (toFile) cli::checkOutput(options.report, {".json"}, options.overwrite);
}

/// Checks the memory for pictures. Each is held as four floats a pixel and is encoded in memory.
/// With --ref there are also the reference's picture, the difference and, with --sheet, the sheet.
void checkPictureSize(const Options& options) {
  constexpr double kBytesPerPixel = 48.0;
  const double pictures = options.reference.empty() ? 1.0 : (options.sheet.empty() ? 3.0 : 6.0);
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

RenderOptions renderOptions(const Options& options, const Scene& scene) {
  RenderOptions r;
  r.resolution = options.resolution;
  r.camera = fitCamera(scene.box, options.camera, options.resolution);
  r.transfer = transferOf(options, scene);
  r.step = options.step;
  r.opacityLength = options.opacityLength;
  r.minTransmittance = options.minTransmittance.value_or(r.minTransmittance);
  r.mode = options.mode;
  r.classification = options.classification;
  r.between = options.between.value_or(usualBetween(scene));
  r.clip = options.clip;
  return r;
}

/// The scene of a file together with its renderer.
struct Drawing {
  Drawing(Scene from, const DrawSettings& settings, const RenderOptions& sample)
      : scene(std::move(from)), renderer(scene, settings, sample) {}

  const Scene scene;
  SceneRenderer renderer;
};

/// The drawing of --ref. If the input is a VDB file, --values applies to the input alone.
std::unique_ptr<Drawing> referenceOf(const Options& options, const DrawSettings& settings,
                                     const RenderOptions& sample) {
  if (options.reference.empty()) return nullptr;
  DrawSettings own = settings;
  if (options.input.extension() != ".esvr") own.values.reset();
  return std::make_unique<Drawing>(readScene({options.reference, std::nullopt, options.memory}),
                                   own, sample);
}

std::string summary(const fs::path& file, const Scene& scene, Resolution r, double seconds) {
  return file.string() + ": " + scene.grid + ", " + std::to_string(r.width) + " x " +
         std::to_string(r.height) + ", " + cli::shortNumber(seconds) + " s";
}

class Frames {
 public:
  Frames(const Options& options, Drawing& drawing, Drawing* reference)
      : options_(options),
        log_(kProgram, options.verbosity),
        drawing_(drawing),
        reference_(reference) {}

  /// Draws one frame. \param sheet  file of the sheet; empty: none
  void draw(const RenderOptions& r, const fs::path& file, const fs::path& sheet) {
    cli::Stopwatch watch;
    const Image image = drawing_.renderer->draw(r);
    const double seconds = watch.lap();
    write(file, image, options_.background);
    log_.info(summary(file, drawing_.scene, r.resolution, seconds));
    if (reference_ != nullptr) compare(r, image, file, sheet);
  }
  void drawDepth(RenderOptions r, const fs::path& file) {
    r.mode = RenderMode::kDepth;
    const auto bytes = encodeDepthExr(drawing_.renderer->draw(r), {software(), commandText()});
    cli::writeBytes(file, bytes, options_.overwrite);
    log_.info(file.string() + ": distances in voxels");
  }
  [[nodiscard]] const nlohmann::ordered_json& comparisons() const { return comparisons_; }

 private:
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

  void compare(const RenderOptions& r, const Image& image, const fs::path& file,
               const fs::path& sheet) {
    constexpr double kGain = 10.0;  // gain of the difference; --help states it
    const Image expected = reference_->renderer->draw(r);
    const ImageMetrics m = compareImages(expected, image);
    const Image error = errorMap(expected, image, kGain);
    write(errorName(file), error, std::nullopt);
    if (!sheet.empty())
      write(sheet, sideBySide(std::array{image, expected, error}), options_.background);
    log_.info(errorName(file).string() + ": PSNR " + cli::shortNumber(m.psnr) + " dB, SSIM " +
              cli::shortNumber(m.ssim) + ", largest error " + cli::shortNumber(m.maxError));
    comparisons_.push_back({{"picture", file.string()},
                            {"psnr", jsonNumber(m.psnr)},
                            {"ssim", m.ssim},
                            {"max_error", m.maxError}});
  }

  const Options& options_;
  const cli::Log log_;
  Drawing& drawing_;
  Drawing* reference_;
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

void drawFrames(const Options& options, RenderOptions r, Frames& frames) {
  const auto files = outputs(options), depths = depthOutputs(options);
  const auto sheets = sheetOutputs(options);
  const Camera first = r.camera;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::size_t number = std::size_t(options.firstFrame) + i;
    if (number > 0) r.camera = turned(first, 360.0 * double(number) / options.turntable);
    frames.draw(r, files[i], sheets.empty() ? fs::path{} : sheets[i]);
    if (!depths.empty()) frames.drawDepth(r, depths[i]);
  }
}

void saveTransfer(const Options& options, const TransferFunction& transfer) {
  if (options.saveTransfer.empty()) return;
  const std::string text = paraViewPreset(transfer, options.saveTransfer.stem().string());
  cli::writeBytes(options.saveTransfer, std::as_bytes(std::span(text)), options.overwrite);
}

}  // namespace

void run(const Options& options) {
  const cli::Interrupts interrupts;
  const auto files = options.bench ? std::vector<fs::path>{} : outputs(options);
  checkFiles(options, files);
  checkPictureSize(options);
  const DrawSettings settings{selectDevice(options.device), options.method, options.limits,
                              options.values, options.memory};
  Scene scene = readScene({options.input, options.grid, options.memory});
  RenderOptions r = renderOptions(options, scene);
  Drawing drawing(std::move(scene), settings, r);
  const auto reference = referenceOf(options, settings, r);
  r.cancel = &interrupts.token();
  saveTransfer(options, r.transfer);
  auto report = reportHead(options, settings.device);
  if (options.bench) {
    const cli::Log log(kProgram, options.verbosity);
    report.update(bench({*drawing.renderer, reference ? &*reference->renderer : nullptr}, r,
                        options.turntable, log));
  } else {
    Frames frames(options, drawing, reference.get());
    drawFrames(options, r, frames);
    report["comparisons"] = frames.comparisons();
  }
  writeReport(options, report);
}

}  // namespace esvr::render
