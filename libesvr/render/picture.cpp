#include "render/picture.h"

#include <cmath>
#include <limits>
#include <string>

#include "esvr/error.h"

namespace esvr {

// Options.

void checkRenderOptions(const RenderOptions& options, std::size_t grids) {
  const auto requirePositive = [](double value, const char* what) {
    if (!(value > 0.0) || !std::isfinite(value))
      throw UsageError(std::string(what) + " must be positive, not " + std::to_string(value));
  };
  const std::size_t looks = options.further.size() + 1;
  if (looks != grids)
    throw UsageError("a picture of " + std::to_string(grids) + " grids needs as many looks, not " +
                     std::to_string(looks));
  checkCamera(options.camera, options.resolution);
  checkTransferFunction(options.transfer);
  for (const GridLook& look : options.further) checkTransferFunction(look.transfer);
  requirePositive(options.step, "the step");
  requirePositive(options.opacityLength, "the opacity's length");
  if (!(options.minTransmittance >= 0.0 && options.minTransmittance < 1.0))
    throw UsageError("the transmittance that ends a ray must be from 0 to below 1");
  if (options.shading) {
    if (options.mode != RenderMode::kComposite)
      throw UsageError("only composited pictures can be shaded");
    (void)lightRule(*options.shading, View(options.camera, options.resolution), options.transfer);
  }
  if (options.clip)
    for (int a = 0; a < 3; ++a)
      if (!(options.clip->low[a] <= options.clip->high[a]))
        throw UsageError("a clip box must not end before it begins");
}

void refuseShading(const RenderOptions& options) {
  if (options.shading)
    throw UsageError("sums of ellipsoids and NanoVDB grids cannot be shaded; draw voxels");
}

void checkCancelled(const RenderOptions& options) {
  if (options.cancel != nullptr && options.cancel->cancelled()) throw Cancelled();
}

// Light.

namespace {

/// The gradient that has half of its effect, as a share of the transfer function's range for each
/// voxel. The noise of a CT scan is weaker, and surfaces are stronger.
constexpr double kWeakShare = 0.02;

float checkedFactor(double factor, const char* name) {
  if (!(factor >= 0.0) || !std::isfinite(factor))
    throw UsageError(std::string("the ") + name + " of the light must not be negative, but is " +
                     std::to_string(factor));
  return float(factor);
}

}  // namespace

LightRule lightRule(const Shading& s, const View& view, const TransferFunction& transfer) {
  // Without a direction, the light is above the left shoulder of someone at the camera's place.
  const Vec3 overShoulder = view.inCameraSpace(
      difference(sum(scaled(view.up, 0.6), scaled(view.right, -0.5)), view.forward));
  const Vec3 light = s.light.value_or(overShoulder);
  const double l = length(light);
  if (!(l > 0.0) || !std::isfinite(l))
    throw UsageError("the direction to the light must have a length");
  const ValueExtent extent = extentOf(transfer);
  const double weak = kWeakShare * (extent.high - extent.low);
  LightRule rule{
      floatPlace(scaled(light, 1.0 / l)),       checkedFactor(s.ambient, "ambient part"),
      checkedFactor(s.diffuse, "diffuse part"), checkedFactor(s.specular, "specular part"),
      checkedFactor(s.shininess, "shininess"),  float(std::pow(weak, 2.0))};
  if (view.isCube) return rule;
  // A gradient's product with an edge of a voxel is the change of the value along this edge, in the
  // index space and in the camera's space.
  const auto& [a, b, c] = view.voxel.edges;
  const double perVolume = 1.0 / inner(cross(a, b), c);
  const Vec3 ofA = scaled(cross(b, c), perVolume), ofB = scaled(cross(c, a), perVolume),
             ofC = scaled(cross(a, b), perVolume);
  rule.converts = true;
  for (std::size_t axis = 0; axis < 3; ++axis)
    rule.toCamera[axis] = floatPlace({ofA[axis], ofB[axis], ofC[axis]});
  return rule;
}

MarchScene marchScene(const RenderOptions& o, const View& view, const SampleRule& rule) {
  MarchScene scene{view, {}, o.step, clipOf(o), rule};
  scene.isShaded = o.shading.has_value();
  if (o.shading) scene.light = lightRule(*o.shading, view, o.transfer);
  return scene;
}

// The depths in which a volume lies.

namespace {

struct Distances {
  double nearest, farthest;
};

Vec3 corner(const PlaceBox& box, int number) {
  const Coord step = stepToCorner(number);
  return {(step.x ? box.high : box.low)[0], (step.y ? box.high : box.low)[1],
          (step.z ? box.high : box.low)[2]};
}

double distanceTo(const PlaceBox& box, const Vec3& eye) {
  Vec3 away{};
  for (int a = 0; a < 3; ++a) away[a] = std::max({box.low[a] - eye[a], 0.0, eye[a] - box.high[a]});
  return length(away);
}

/// The distances for voxels that are no cubes. The nearest one is that of the sphere around the
/// box.
Distances fromEyeByCoordinates(const PlaceBox& box, const View& view) {
  const Vec3 middle = scaled(sum(box.low, box.high), 0.5);
  double radius = 0.0;
  Distances d{0.0, 0.0};
  for (int c = 0; c < kCellCorners; ++c) {
    const Vec3 at = corner(box, c);
    radius = std::max(radius, length(view.coordinates(difference(at, middle))));
    d.farthest = std::max(d.farthest, length(view.coordinates(difference(at, view.eye))));
  }
  d.nearest = std::max(0.0, length(view.coordinates(difference(middle, view.eye))) - radius);
  return d;
}

Distances fromEye(const PlaceBox& box, const View& view) {
  if (!view.isCube) return fromEyeByCoordinates(box, view);
  Distances d{distanceTo(box, view.eye), 0.0};
  for (int c = 0; c < kCellCorners; ++c)
    d.farthest = std::max(d.farthest, length(difference(corner(box, c), view.eye)));
  return d;
}

Distances alongForward(const PlaceBox& box, const View& view) {
  Distances d{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (int c = 0; c < kCellCorners; ++c) {
    const double depth = inner(view.ofForward, difference(corner(box, c), view.eye));
    d.nearest = std::min(d.nearest, depth), d.farthest = std::max(d.farthest, depth);
  }
  return d;
}

}  // namespace

BinRange binsWithin(const PlaceBox& box, const View& view, double step) {
  const Distances d = view.perspective ? fromEye(box, view) : alongForward(box, view);
  if (d.farthest < 0.0) return {0, -1};
  return binsOf(std::max(0.0, d.nearest), d.farthest, {1.0, 1.0}, step);
}

void checkRayLength(const BinRange& bins) {
  constexpr std::int64_t kMaxBins = kMostRaySamples / kBinSamples;
  const std::int64_t count = bins.last - bins.first + 1;
  if (count > kMaxBins)
    throw UsageError("rays of " + std::to_string(count) + " x " + std::to_string(kBinSamples) +
                     " samples are too long; take a longer step");
}

// Levels of detail.

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// Voxels of a level, by their longest edges, along the side of a pixel where it begins. With
/// fewer, the picture is blurred more than a pixel blurs it; with many, stray pixels remain.
/// Against pictures with 16 rays a pixel, values from 2.5 to 4 had the best PSNR for seven volumes
/// at 40 to 300 pixels, from 0.6 dB below to 4 dB above that of pictures without levels
/// (docs/lab-notes.md).
constexpr double kVoxelsPerPixel = 3.0;

/// The first sample at which pixels are wide enough for a level.
double beginOf(int level, const View& view, double step) {
  const double side = LevelFrame{level}.side(), width = kVoxelsPerPixel * side * view.longestEdge;
  if (!view.perspective) return view.pixel < width ? kNever : 0.0;
  return std::ceil(width / view.pixel / step / side) * side;
}

/// False if samples of a level may miss the clip box because it is too thin.
bool fits(const RenderOptions& options, const View& view, int level) {
  if (!options.clip) return true;
  // A step may be longer in voxels than in the camera's space if the voxels are sheared.
  const double voxels =
      view.isCube ? 1.0 : length(view.right) + length(view.up) + length(view.forward);
  const double apart = LevelFrame{level}.side() * std::max(options.step * voxels, 1.0);
  for (int a = 0; a < 3; ++a)
    if (options.clip->high[a] - options.clip->low[a] < 2.0 * apart) return false;
  return true;
}

int levelAt(const LevelBounds& bounds, double sample) {
  int level = 0;
  while (level + 1 < kLevels && bounds.begin[std::size_t(level) + 1] <= sample) ++level;
  return level;
}

}  // namespace

LevelBounds levelBounds(const RenderOptions& options, const View& view, const PlaceBox& box) {
  LevelBounds bounds;
  bounds.begin.fill(kNever);
  bounds.begin[0] = 0.0;
  if (options.lod == LevelOfDetail::kOff) return bounds;
  for (int level = 1; level < kLevels && fits(options, view, level); ++level)
    bounds.begin[std::size_t(level)] = beginOf(level, view, options.step);
  const BinRange bins = binsWithin(box, view, options.step);
  bounds.first = levelAt(bounds, double(bins.first) * kBinSamples);
  bounds.last = levelAt(bounds, double(bins.last + 1) * kBinSamples);
  return bounds;
}

// Pixels.

Picture::Picture(const RenderOptions& options, const PlaceBox& box, std::size_t grids)
    : view((checkRenderOptions(options, grids), viewOf(options, box))),
      table(options.transfer, samplingOf(options)),
      image_{options.resolution.width, options.resolution.height, {}} {
  image_.rgba.resize(std::size_t(4) * std::size_t(image_.width) * std::size_t(image_.height));
}

}  // namespace esvr
