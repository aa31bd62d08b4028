#include "render/look.h"

#include <algorithm>

#include "esvr/did_you_mean.h"
#include "esvr/error.h"
#include "programs/option_values.h"
#include "programs/video_file.h"

namespace esvr::render {

// Texts.

namespace {

std::optional<TransferFunction> transferOf(const LookText& text, const std::string& usualColors) {
  if (!text.tf && text.preset) throw UsageError("--preset says nothing without --tf");
  if (!text.tf && !text.opacity && !text.colors) return std::nullopt;
  if (!text.tf)
    return TransferFunction{builtInColorMap(text.colors.value_or(usualColors)),
                            builtInOpacity(text.opacity.value_or(kUsualOpacity))};
  if (text.colors) throw UsageError("--tf and --colors are two color maps; give one");
  auto f = readParaViewPreset(*text.tf, text.preset.value_or(""));
  if (!text.opacity) return f;
  const auto& points = f.colors.points;
  f.opacity = builtInOpacity(*text.opacity);
  for (auto& p : f.opacity) p.x = points.front().x + p.x * (points.back().x - points.front().x);
  return f;
}

void readRange(const std::string& text, Look& look) {
  if (text == "auto")
    look.rangeKind = RangeKind::kAuto;
  else if (text == "data")
    look.rangeKind = RangeKind::kData;
  else if (text == "own")
    look.rangeKind = RangeKind::kOwn;
  else {
    const auto v = cli::parseNumbers("range", text, 2);
    if (v[0] > v[1]) throw UsageError("--range must have LO <= HI, not '" + text + "'");
    look.rangeKind = RangeKind::kGiven;
    look.range = {float(v[0]), float(v[1])};
  }
}

/// Reads one part of --with after the name.
void readPart(const std::string& part, LookText& text, FurtherGrid& grid) {
  const auto equals = part.find('=');
  const std::string key = part.substr(0, equals);
  const std::string value = equals == std::string::npos ? "" : part.substr(equals + 1);
  if (key == "emission" && equals == std::string::npos)
    grid.absorbs = false;
  else if (key == "colors" && !value.empty())
    text.colors = value;
  else if (key == "opacity" && !value.empty())
    text.opacity = value;
  else if (key == "tf" && !value.empty())
    text.tf = value;
  else if (key == "preset" && !value.empty())
    text.preset = value;
  else if (key == "range" && !value.empty())
    text.range = value;
  else {
    const std::vector<std::string> keys{"emission", "colors", "opacity", "tf", "preset", "range"};
    throw UsageError("'" + part +
                     "' must be emission, or one of colors, opacity, tf, preset and range with '=' "
                     "and a value" +
                     didYouMean(key, keys));
  }
}

}  // namespace

Look lookOf(const LookText& text, const std::string& usualColors) {
  Look look;
  look.transfer = transferOf(text, usualColors);
  look.hasOpacity = text.tf || text.opacity;
  readRange(text.range, look);
  return look;
}

FurtherGrid furtherGridOf(const std::string& text) {
  const auto parts = cli::splitText(text, ':');
  FurtherGrid grid{parts.front(), {}};
  if (grid.name.empty()) throw UsageError("--with must begin with the name of a grid");
  LookText look;
  try {
    for (std::size_t i = 1; i < parts.size(); ++i) readPart(parts[i], look, grid);
    grid.look = lookOf(look, kUsualFurtherColors);
  } catch (const UsageError& error) {
    throw UsageError("--with " + text + ": " + error.what());
  }
  return grid;
}

// Transfer functions and their color bars.

namespace {

ValueRange rangeOf(const Look& look, const Scene& scene) {
  if (look.rangeKind == RangeKind::kGiven) return look.range;
  if (look.rangeKind == RangeKind::kData) return scene.data;
  return {std::min(scene.data.min, scene.background), std::max(scene.data.max, scene.background)};
}

LookBasis basisOf(const Scene& scene) {
  return {scene.data, scene.background, scene.isLevelSet, scene.medianDepth};
}

/// The transfer function over its range: the usual look, or what options ask for. Light passes
/// through a composite only, so that other modes have a linear opacity.
/// \param usualColors  color map without an option
TransferFunction transferOf(const Look& look, const Scene& scene, RenderMode mode,
                            const char* usualColors) {
  const bool usual = look.rangeKind == RangeKind::kAuto && mode == RenderMode::kComposite;
  if (usual && !look.transfer) return usualLook(basisOf(scene), usualColors);
  const TransferFunction function = look.transfer.value_or(
      TransferFunction{builtInColorMap(usualColors), builtInOpacity(kUsualOpacity)});
  if (look.rangeKind == RangeKind::kOwn) return function;
  TransferFunction over = rescaled(function, rangeOf(look, scene));
  if (usual && !look.hasOpacity) over.opacity = usualOpacity(basisOf(scene));
  return over;
}

TransferFunction transferOf(const Options& options, const Scene& scene) {
  return transferOf(options.look, scene, options.mode, kUsualColors);
}

/// The color bar of a picture of a scene. \param transfer  over its range of values
report::ColorBar legendOf(const Options& options, const Scene& scene,
                          const TransferFunction& transfer) {
  constexpr int kShades = 1024;  // more than the rows of usual bars
  const double low = std::min(transfer.colors.points.front().x, transfer.opacity.front().x);
  const double high = std::max(transfer.colors.points.back().x, transfer.opacity.back().x);
  report::ColorBar bar{.name = scene.grid, .unit = scene.unit, .low = low, .high = high};
  for (int i = 0; i < kShades; ++i) {
    const double value = low + (i + 0.5) / kShades * (high - low);
    const Rgb color = colorAt(transfer.colors, value);
    bar.shades.push_back({{color.r, color.g, color.b}, opacityAt(transfer.opacity, value)});
  }
  // A picture without a background is transparent, and a video is black.
  const bool video = report::isVideo(options.output);
  const Rgb behind = options.background.value_or(video ? Rgb{} : Rgb{1.0, 1.0, 1.0});
  bar.background = {behind.r, behind.g, behind.b};
  return bar;
}

}  // namespace

std::optional<report::ColorBar> barOf(const Options& options, const Scene& scene) {
  if (!options.legend) return std::nullopt;
  return legendOf(options, scene, transferOf(options, scene));
}

// Cameras and pictures.

namespace {

/// A box around all grids.
Box boxOf(const std::vector<Scene>& scenes) {
  Box box;
  for (const Scene& scene : scenes)
    if (!scene.box.empty()) box.expand(scene.box.min), box.expand(scene.box.max);
  return box;
}

/// The shape of the voxels; that of a cube without an affine transform.
VoxelShape voxelOf(const std::vector<Scene>& scenes) {
  return voxelShape(scenes.front().transform.affine).value_or(VoxelShape{});
}

/// The camera; if it is fitted, the volume lies beside the color bar.
Camera cameraOf(const Options& options, const std::vector<Scene>& scenes) {
  const Resolution r = options.resolution;
  CameraWish wish = options.camera;
  // Benchmarks use the sphere around the volume, so that their figures are those of earlier
  // versions.
  wish.framing = options.bench            ? Framing::kSphere
                 : options.turntable == 0 ? Framing::kBox
                                          : Framing::kTurn;
  wish.voxel = voxelOf(scenes);
  if (const auto bar = barOf(options, scenes.front()))
    wish.freeRight = report::colorBarShare(*bar, r.width, r.height);
  return fitCamera(boxOf(scenes), wish, r);
}

}  // namespace

Vec3 pivotOf(const Options& options, const std::vector<Scene>& scenes) {
  CameraWish wish = options.camera;
  wish.voxel = voxelOf(scenes);
  return esvr::pivotOf(boxOf(scenes), wish);
}

RenderOptions renderOptions(const Options& options, const std::vector<Scene>& scenes) {
  const Scene& scene = scenes.front();
  RenderOptions r;
  r.resolution = options.resolution;
  r.camera = cameraOf(options, scenes);
  r.transfer = transferOf(options, scene);
  for (std::size_t i = 0; i < options.with.size(); ++i) {
    const FurtherGrid& grid = options.with[i];
    r.further.push_back(
        {transferOf(grid.look, scenes[i + 1], options.mode, kUsualFurtherColors), grid.absorbs});
  }
  r.step = options.step;
  r.opacityLength = options.opacityLength;
  r.minTransmittance = options.minTransmittance.value_or(r.minTransmittance);
  r.mode = options.mode;
  r.classification = options.classification;
  r.lod = options.lod;
  r.shading = options.shading;
  r.between = options.between;
  r.clip = options.clip;
  return r;
}

}  // namespace esvr::render
