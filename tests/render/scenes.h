#pragma once
/// What the tests draw: volumes of full bricks, fields, cameras and the options of pictures.

#include <cmath>
#include <utility>
#include <vector>

#include "esvr/field.h"
#include "esvr/render.h"
#include "fit/volumes.h"

namespace esvr::test {

// Options.

/// The box of a field of extent 40, as randomField() makes it.
constexpr Box kFieldBox{{0, 0, 0}, {39, 39, 39}};

inline TransferFunction viridis(ValueRange range = {-1.0f, 1.0f}) {
  return rescaled({builtInColorMap("viridis"), builtInOpacity("linear")}, range);
}

/// A picture of a box in the colors of viridis(). A large length of the opacity lets rays pass through.
inline RenderOptions pictureOf(const Box& box, Resolution resolution, double opacityLength,
                               const CameraWish& wish = {}) {
  RenderOptions o;
  o.resolution = resolution;
  o.camera = fitCamera(box, wish, resolution);
  o.transfer = viridis();
  o.opacityLength = opacityLength;
  return o;
}

inline CameraWish orthographic() { return {.projection = Projection::kOrthographic}; }
/// A camera inside kFieldBox.
inline CameraWish inside(double fov = 80.0) {
  return {.eye = Vec3{19.3, 21.7, 18.1}, .center = Vec3{0, 40, 3}, .fov = fov};
}
/// A camera 4e6 voxels away that sees a sphere of a radius.
inline CameraWish farAway(const Vec3& center = {20, 20, 20}, double radius = 30.0) {
  CameraWish wish{.eye = Vec3{1e6, 2e6, 3.3e6}, .center = center};
  wish.fov = 2.0 * std::atan(radius / 4e6) * 180.0 / 3.14159265358979;
  return wish;
}
/// A camera that looks away from kFieldBox.
inline CameraWish away() { return {.eye = Vec3{20, 20, 200}, .center = Vec3{20, 20, 300}}; }

// Volumes.

/// A cube of so many bricks a side, whose voxels have the values of a function of their places.
template <class Value>
SparseVolume cubeOf(int side, float background, const Value& value) {
  return fullBricks(cornersOfCube(side), background, value);
}

inline RenderOptions optionsFor(const SparseVolume& volume, const CameraWish& wish = {}) {
  RenderOptions o = pictureOf(activeBox(volume), {45, 38}, 10.0, wish);
  o.transfer = {builtInColorMap("turbo"), builtInOpacity("linear")};
  o.lod = LevelOfDetail::kOff;
  return o;
}

// Fields.

/// A background above 0, and two chunks, the second of which has an origin of its own.
inline Field twoChunks() {
  Field field = randomField({.count = 20});
  field.background = 0.25f;
  field.chunks.push_back(randomField({.count = 20, .extent = 20.0, .seed = 9}).chunks[0]);
  field.chunks[1].origin = {16, -8, 8};
  return field;
}

/// Ellipsoids with a kappa of their own each.
inline Field ownKappas() {
  Field field = randomField({.count = 15, .kappa = 5.0f});
  field.chunks[0].ellipsoids.kappa.assign(15, 1.0f);
  field.chunks[0].ellipsoids.kappa[3] = 20.0f;
  return field;
}

inline Field oneEllipsoid(double smallest, float intensity = 0.3f, double aspect = 4.0) {
  Field field = randomField({.count = 1, .smallest = smallest, .aspect = aspect});
  field.chunks[0].ellipsoids.intensity[0] = intensity;
  return field;
}

inline Field withoutNegatives(Field field) {
  for (Chunk& chunk : field.chunks)
    for (float& intensity : chunk.ellipsoids.intensity) intensity = std::abs(intensity);
  return field;
}

/// Puffs over 60,000 voxels, with nothing between them.
inline Field puffsFarApart() {
  Field field =
      randomField({.count = 60, .extent = 60'000.0, .smallest = 3.0, .aspect = 2.0, .seed = 11});
  for (float& intensity : field.chunks[0].ellipsoids.intensity)
    intensity = 0.5f + 0.5f * std::abs(intensity);
  return field;
}

/// Lets a camera look at one of the ellipsoids from nearby.
inline void lookAt(const Field& field, std::size_t ellipsoid, Camera& camera) {
  const auto& center = field.chunks[0].ellipsoids.center;
  const Vec3 at{center[0][ellipsoid], center[1][ellipsoid], center[2][ellipsoid]};
  camera.center = at, camera.eye = {at[0] + 10.0, at[1] + 30.0, at[2] + 60.0};
}

/// Bricks with masks of which half of the voxels are active.
struct HalfMasks {
  std::vector<Coord> bricks;
  std::vector<BrickMask> masks;

  HalfMasks(const Field& field, const Box& reached)
      : bricks(reachedBricks(field, reached)), masks(bricks.size()) {
    for (std::size_t b = 0; b < masks.size(); ++b)
      for (int v = 0; v < kBrickVoxels; ++v)
        if ((v + int(b)) % 16 < 8) masks[b].set(v);
  }
  /// The rule of the masks within a box that cuts through bricks.
  [[nodiscard]] RevoxeliseOptions within(const Box& box) const {
    return {.bricks = bricks, .restrictToBricks = true, .masks = masks, .box = box};
  }
};

// Two grids that overlap in part, and a picture of both.

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
  RenderOptions o = pictureOf({{0, 0, 0}, {79, 63, 59}}, {61, 47}, 20.0);
  o.camera = turned(o.camera, degrees);
  o.lod = LevelOfDetail::kOff;
  o.further = {{rescaled({builtInColorMap("inferno"), builtInOpacity("linear")}, {-1.0f, 1.0f})}};
  return o;
}

}  // namespace esvr::test
