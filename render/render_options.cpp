#include "render/render_options.h"

#include <algorithm>

#include "render/legend.h"

namespace esvr::render {
namespace {

ValueRange rangeOf(const Look& look, const Scene& scene) {
  if (look.rangeKind == RangeKind::kGiven) return look.range;
  if (look.rangeKind == RangeKind::kData) return scene.data;
  return {std::min(scene.data.min, scene.background), std::max(scene.data.max, scene.background)};
}

/// The transfer function over its range. A level set is drawn as an opaque body unless an option
/// asks for another function or range.
/// \param usualColors  color map without an option
TransferFunction transferOf(const Look& look, const Scene& scene, RenderMode mode,
                            const char* usualColors) {
  const bool usual = !look.transfer && look.rangeKind == RangeKind::kAuto;
  const bool composite = mode == RenderMode::kComposite;
  if (usual && composite && scene.isLevelSet && scene.background > 0.0f)
    return levelSetSurface(double(scene.background));
  const TransferFunction function = look.transfer.value_or(
      TransferFunction{builtInColorMap(usualColors), builtInOpacity(kUsualOpacity)});
  if (look.rangeKind == RangeKind::kOwn) return function;
  return rescaled(function, rangeOf(look, scene));
}

TransferFunction transferOf(const Options& options, const Scene& scene) {
  return transferOf(options.look, scene, options.mode, kUsualColors);
}

/// Benchmarks use the sphere around the volume, so that their figures are those of earlier versions.
Framing framingOf(const Options& options) {
  if (options.bench) return Framing::kSphere;
  return options.turntable == 0 ? Framing::kBox : Framing::kTurn;
}

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
  wish.framing = framingOf(options);
  wish.voxel = voxelOf(scenes);
  if (const auto bar = barOf(options, scenes.front()))
    wish.freeRight = report::colorBarShare(*bar, r.width, r.height);
  return fitCamera(boxOf(scenes), wish, r);
}

std::vector<GridLook> furtherLooks(const Options& options, const std::vector<Scene>& scenes) {
  std::vector<GridLook> looks;
  for (std::size_t i = 0; i < options.with.size(); ++i) {
    const FurtherGrid& grid = options.with[i];
    looks.push_back(
        {transferOf(grid.look, scenes[i + 1], options.mode, kUsualFurtherColors), grid.absorbs});
  }
  return looks;
}

}  // namespace

std::optional<report::ColorBar> barOf(const Options& options, const Scene& scene) {
  if (!options.legend) return std::nullopt;
  return legendOf(options, scene, transferOf(options, scene));
}

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
  r.further = furtherLooks(options, scenes);
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
