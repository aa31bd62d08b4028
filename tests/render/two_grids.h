#pragma once
/// Two grids that overlap in part, and a picture of both.

#include "esvr/render.h"
#include "field/random_field.h"

namespace esvr::test {

/// The second grid has other bricks than the first, and lies further along x.
inline Field firstField() { return randomField({.count = 300, .extent = 60.0, .smallest = 1.0}); }
inline Field secondField() {
  return randomField(
      {.count = 100, .extent = 50.0, .smallest = 1.0, .origin = {24, 8, 0}, .seed = 11});
}

inline const RevoxeliseOptions kVoxelsOfGrids{.threshold = 0.05f};

/// A picture in which a segment of a ray absorbs little.
/// \param degrees  turn of the camera
inline RenderOptions optionsForTwo(double degrees = 20.0) {
  RenderOptions o;
  o.resolution = {61, 47};
  o.camera = turned(fitCamera({{0, 0, 0}, {79, 63, 59}}, {}, o.resolution), degrees);
  o.transfer = rescaled({builtInColorMap("viridis"), builtInOpacity("linear")}, {-1.0f, 1.0f});
  o.opacityLength = 20.0;
  o.lod = LevelOfDetail::kOff;
  o.further = {{rescaled({builtInColorMap("inferno"), builtInOpacity("linear")}, {-1.0f, 1.0f})}};
  return o;
}

/// A transfer function that leaves everything transparent.
inline TransferFunction transparent() {
  TransferFunction transfer{builtInColorMap("viridis"), builtInOpacity("linear")};
  for (auto& point : transfer.opacity) point.opacity = 0.0;
  return transfer;
}

}  // namespace esvr::test
