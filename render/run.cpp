#include "render/run.h"

#include <algorithm>
#include <vector>

#include "cli/bytes_file.h"
#include "cli/interrupts.h"
#include "cli/output.h"
#include "cli/stopwatch.h"
#include "cli/table.h"
#include "cli/version_text.h"
#include "render/png_file.h"
#include "render/scene.h"

namespace esvr::render {
namespace {

namespace fs = std::filesystem;

/// "turn.png" and 7: "turn.0007.png".
fs::path frameName(const fs::path& output, int frame) {
  constexpr std::size_t kDigits = 4;
  std::string number = std::to_string(frame);
  number.insert(0, kDigits - std::min(kDigits, number.size()), '0');
  fs::path name = output;
  return name.replace_extension(number + output.extension().string());
}

std::vector<fs::path> outputs(const Options& options) {
  if (options.turntable == 0) return {options.output};
  std::vector<fs::path> names;
  for (int i = 0; i < options.turntable; ++i) names.push_back(frameName(options.output, i));
  return names;
}

/// All that can go wrong without work goes wrong before it.
void checkFiles(const Options& options, const std::vector<fs::path>& files) {
  for (const auto& file : files) {
    cli::requireDistinct({options.input, file});
    cli::checkOutput(file, {".png"}, options.overwrite);
  }
}

ValueRange rangeOf(const Options& options, const Scene& scene) {
  if (options.rangeKind == RangeKind::kGiven) return options.range;
  if (options.rangeKind == RangeKind::kData) return scene.data;
  return {std::min(scene.data.min, scene.background), std::max(scene.data.max, scene.background)};
}

RenderOptions renderOptions(const Options& options, const Scene& scene) {
  RenderOptions r;
  r.resolution = options.resolution;
  r.camera = fitCamera(scene.box, options.camera, options.resolution);
  r.transfer = options.rangeKind == RangeKind::kOwn
                   ? options.transfer
                   : rescaled(options.transfer, rangeOf(options, scene));
  r.step = options.step;
  r.opacityLength = options.opacityLength;
  return r;
}

std::string summary(const fs::path& file, const Scene& scene, Resolution r, double seconds) {
  return file.string() + ": " + scene.grid + ", " + std::to_string(r.width) + " x " +
         std::to_string(r.height) + ", " + cli::shortNumber(seconds) + " s";
}

void drawFrame(const Scene& scene, const RenderOptions& r, const Options& options,
               const fs::path& file) {
  cli::Stopwatch watch;
  const Image image = draw(scene, r);
  const double seconds = watch.lap();
  const PngText text{std::string(kProgram) + " " + cli::programVersion(), options.commandLine};
  cli::writeBytes(file, encodePng(image, options.background, text), options.overwrite);
  cli::Log(kProgram, options.verbosity).info(summary(file, scene, r.resolution, seconds));
}

}  // namespace

void run(const Options& options) {
  const cli::Interrupts interrupts;
  const auto files = outputs(options);
  checkFiles(options, files);
  const Scene scene = readScene(options.input, options.grid);
  RenderOptions r = renderOptions(options, scene);
  r.cancel = &interrupts.token();
  const Camera first = r.camera;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (i > 0) r.camera = turned(first, 360.0 * double(i) / double(files.size()));
    drawFrame(scene, r, options, files[i]);
  }
}

}  // namespace esvr::render
