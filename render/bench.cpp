#include "render/scene.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>
#include <vector>

#include "esvr/image_metrics.h"
#include "programs/run_main.h"

namespace esvr::render {

Image drawSupersampled(Renderer& renderer, RenderOptions options, int samples) {
  if (samples == 1) return renderer.draw(options);
  options.lod = LevelOfDetail::kOff;
  options.resolution.width *= samples;
  options.resolution.height *= samples;
  return meansOfSquares(renderer.draw(options), samples);
}

namespace {

using Json = nlohmann::ordered_json;

constexpr int kDefaultViews = 720;  // as in the paper: steps of 0.5 degrees
constexpr int kCompared = 36;
constexpr int kCold = 36;          // views that are drawn with nothing decoded before
constexpr double kSlowest = 0.01;  // share of the frames that "1 % low" averages

/// The times of all frames after the warm-up.
struct Times {
  std::vector<double> frameMs, listMs, drawMs;
  double listEntries = 0.0, occupancy = 0.0;  ///< means over the frames
  FrameStats last;
};

double median(std::vector<double> v) {
  const auto middle = v.begin() + std::ptrdiff_t(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

/// Mean of the slowest hundredth of the frames, at least of one.
double slowest(std::vector<double> v) {
  std::sort(v.begin(), v.end(), std::greater<>());
  const auto n = std::max<std::size_t>(1, std::size_t(std::ceil(double(v.size()) * kSlowest)));
  return std::accumulate(v.begin(), v.begin() + std::ptrdiff_t(n), 0.0) / double(n);
}

RenderOptions viewOf(RenderOptions options, int view, int views) {
  options.camera = turned(options.camera, 360.0 * view / views);
  return options;
}

void count(const FrameStats& stats, double seconds, int views, Times& times) {
  times.frameMs.push_back(seconds * 1e3);
  times.listMs.push_back(stats.listMs);
  times.drawMs.push_back(stats.drawMs);
  times.listEntries += double(stats.listEntries) / views;
  times.occupancy += stats.occupancy / views;
  times.last = stats;
}

/// Times the views of a turn. \param cold  whether the renderer forgets what it decoded before
Times timed(Renderer& renderer, const RenderOptions& options, int views, bool cold) {
  Times times;
  for (int i = 0; i < views; ++i) {
    const RenderOptions view = viewOf(options, i, views);
    if (cold) renderer.forget();
    cli::Stopwatch watch;
    renderer.drawOnDevice(view);
    count(renderer.stats(), watch.lap(), views, times);
  }
  return times;
}

Json figures(const Times& t) {
  const double drawMs = median(t.drawMs);
  return {{"fps_median", 1e3 / median(t.frameMs)},
          {"fps_1_percent_low", 1e3 / slowest(t.frameMs)},
          {"frame_ms", median(t.frameMs)},
          {"list_ms", median(t.listMs)},
          {"draw_ms", drawMs},
          {"device_bytes", t.last.deviceBytes},
          {"occupancy", t.occupancy},
          {"list_entries", t.listEntries},
          {"list_entries_per_second", drawMs > 0.0 ? t.listEntries / drawMs * 1e3 : 0.0},
          {"depth_parts", t.last.depthParts}};
}

std::string summary(const std::string& what, const Json& f) {
  const auto number = [&](const char* key) { return cli::shortNumber(f[key].get<double>()); };
  return what + ": " + number("fps_median") + " frames a second (1 % low " +
         number("fps_1_percent_low") + ", nothing decoded before " + number("cold_fps_median") +
         "), lists " + number("list_ms") + " ms, drawing " + number("draw_ms") +
         " ms, device memory " + cli::shortNumber(f["device_bytes"].get<double>() / 1e6) + " MB";
}

Json meanAndMin(const std::vector<double>& v) {
  return {{"mean", jsonNumber(std::accumulate(v.begin(), v.end(), 0.0) / double(v.size()))},
          {"min", jsonNumber(*std::min_element(v.begin(), v.end()))}};
}

/// The figures of a renderer that has decoded what it draws, and of one that has decoded nothing.
Json measured(Renderer& renderer, const RenderOptions& options, int views) {
  (void)timed(renderer, options, views, false);  // decodes what the views show
  Json report = figures(timed(renderer, options, views, false));
  const Times cold = timed(renderer, options, std::min(views, kCold), true);
  report["cold_fps_median"] = 1e3 / median(cold.frameMs);
  return report;
}

Json compared(const Benched& benched, const RenderOptions& options, int views) {
  std::vector<double> psnrs, ssims;
  double maxError = 0.0;
  const int count = std::min(kCompared, views);
  for (int i = 0; i < count; ++i) {
    const RenderOptions view = viewOf(options, i, count);
    const ImageMetrics m =
        compareImages(drawSupersampled(*benched.reference, view, benched.referenceSamples),
                      benched.renderer.draw(view));
    psnrs.push_back(m.psnr), ssims.push_back(m.ssim);
    maxError = std::max(maxError, m.maxError);
  }
  return {{"views", count},
          {"psnr", meanAndMin(psnrs)},
          {"ssim", meanAndMin(ssims)},
          {"max_error", maxError}};
}

/// The share of a picture's pixels that the volume covers.
double coveredShare(const Image& image) {
  std::size_t covered = 0, pixels = image.rgba.size() / 4;
  for (std::size_t p = 0; p < pixels; ++p) covered += image.rgba[4 * p + 3] > 0.0f;
  return double(covered) / double(pixels);
}

/// The paper's 'screen occupancy': the mean share of covered pixels over a full turn.
double screenOccupancy(Renderer& renderer, const RenderOptions& options, int views) {
  const int count = std::min(kCompared, views);
  double sum = 0.0;
  for (int i = 0; i < count; ++i) sum += coveredShare(renderer.draw(viewOf(options, i, count)));
  return sum / count;
}

}  // namespace

Json jsonNumber(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json bench(const Benched& benched, const RenderOptions& options, int views, const cli::Log& log) {
  const int count = views == 0 ? kDefaultViews : views;
  Json report{{"width", options.resolution.width},
              {"height", options.resolution.height},
              {"step", options.step},
              {"views", count}};
  report["drawn"] = measured(benched.renderer, options, count);
  report["screen_occupancy"] = screenOccupancy(benched.renderer, options, count);
  log.info(summary("drawn", report["drawn"]));
  if (benched.reference == nullptr) return report;
  report["reference"] = measured(*benched.reference, options, count);
  log.info(summary("reference", report["reference"]));
  report["image"] = compared(benched, options, count);
  const Json& image = report["image"];
  log.info("PSNR " + image["psnr"].dump() + ", SSIM " + image["ssim"].dump());
  return report;
}

}  // namespace esvr::render
