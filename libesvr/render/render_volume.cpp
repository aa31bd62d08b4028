// Draws a volume on the CPU, in float64 and straight from its voxels. It shares with the march
// through bricks of cells only the rule for samples, and is the reference for it.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/brick_index.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "render/picture.h"
#include "render/render_cells.h"

namespace esvr {
namespace {

// Trilinear interpolation.

/// The eight voxels around a place, given by the lowest of them and the position of the place
/// between it and the next voxels, from 0 to 1 along each axis.
struct Cell {
  Coord voxel;
  std::array<float, 3> fraction;
};

/// As brick_march::wholeBelow().
std::int32_t wholeBelow(double at) {
  const auto whole = std::int32_t(at);
  return whole - std::int32_t(double(whole) > at);
}

Cell cellOf(const Vec3& place) {
  const Coord voxel{wholeBelow(place[0]), wholeBelow(place[1]), wholeBelow(place[2])};
  return {voxel, {float(place[0] - voxel.x), float(place[1] - voxel.y), float(place[2] - voxel.z)}};
}

/// Interpolates in a volume, to which it keeps a reference. Coordinates are relative to the
/// volume's origin.
class VoxelSampler {
 public:
  /// The numbers of a brick and of its seven upper neighbours, by the number of the corner. kNone:
  /// no such brick.
  using Corners = std::array<std::uint32_t, kCellCorners>;

  explicit VoxelSampler(const SparseVolume& volume);

  /// The bricks that the cells of a brick read; null if all these voxels are the background.
  [[nodiscard]] const Corners* find(Coord brick) const {
    const std::uint32_t at = index_.find(brick);
    return at == BrickIndex::kNone ? nullptr : &corners_[at];
  }
  /// The result is exactly the background if all eight voxels are.
  [[nodiscard]] float interpolate(const Corners& corners, const Cell& cell) const;

  /// All cells outside this box have the background at their corners.
  [[nodiscard]] const Vec3& low() const { return low_; }
  [[nodiscard]] const Vec3& high() const { return high_; }

 private:
  [[nodiscard]] float value(const Corners& corners, Coord local) const;

  const SparseVolume& volume_;
  BrickIndex index_;
  std::vector<Corners> corners_;
  Vec3 low_, high_;
};

VoxelSampler::VoxelSampler(const SparseVolume& volume)
    : volume_(volume), index_(bricksWithCells(volume.bricks)) {
  const BrickIndex stored(volume.bricks);
  for (const Coord brick : index_.bricks()) {
    Corners corners;
    for (int c = 0; c < kCellCorners; ++c) corners[c] = stored.find(brick + stepToCorner(c));
    corners_.push_back(corners);
  }
  Box box;
  for (const Coord brick : volume.bricks) box.expand(brick);
  low_ = difference(pointOf(box.min * kBrickSide), {1.0, 1.0, 1.0});
  high_ = pointOf((box.max + Coord{1, 1, 1}) * kBrickSide);
}

float VoxelSampler::value(const Corners& corners, Coord local) const {
  const std::uint32_t brick = corners[cornerAt(brickOf(local))];
  if (brick == BrickIndex::kNone) return volume_.background;
  return volume_.values[std::size_t(brick) * kBrickVoxels + voxelOffset(localOf(local))];
}

float VoxelSampler::interpolate(const Corners& corners, const Cell& cell) const {
  const Coord local = localOf(cell.voxel);
  float v[kCellCorners];
  constexpr int kLast = kBrickSide - 1;
  if (local.x < kLast && local.y < kLast && local.z < kLast) {  // most cells lie in one brick
    if (corners[0] == BrickIndex::kNone) return volume_.background;
    const float* const first =
        &volume_.values[std::size_t(corners[0]) * kBrickVoxels + voxelOffset(local)];
    for (int c = 0; c < kCellCorners; ++c) v[c] = first[voxelOffset(stepToCorner(c))];
  } else {
    for (int c = 0; c < kCellCorners; ++c) v[c] = value(corners, local + stepToCorner(c));
  }
  const auto between = [](float a, float b, float s) { return a + s * (b - a); };
  const auto [x, y, z] = cell.fraction;
  const float low = between(between(v[0], v[1], z), between(v[2], v[3], z), y);
  const float high = between(between(v[4], v[5], z), between(v[6], v[7], z), y);
  return between(low, high, x);
}

// The march of a ray.

/// The number of the first sample behind an empty brick. Because of rounding, a sample on the far
/// face of the brick may be visited twice, but it is never skipped.
double behindBrick(const Ray& ray, Coord brick, double step) {
  constexpr double kRounding = 1e-6;
  const Vec3 low{double(brick.x) * kBrickSide, double(brick.y) * kBrickSide,
                 double(brick.z) * kBrickSide};
  const Vec3 high = sum(low, {kBrickSide, kBrickSide, kBrickSide});
  return std::ceil(within(ray, {low, high}).end / step - kRounding);
}

/// Marches rays through a volume or one of its coarser levels.
class RayMarch {
 public:
  /// \param scene   in the index space of level 0; its box is not used
  /// \param volume  the voxels of the level
  RayMarch(const SparseVolume& volume, LevelFrame frame, const MarchScene& scene)
      : sampler_(volume), scene_(sceneOfLevel(scene, frame, volume.origin)) {
    scene_.box = {sampler_.low(), sampler_.high()};
  }
  [[nodiscard]] const MarchScene& scene() const { return scene_; }

  /// Adds the samples of a range to a ray.
  void march(const Ray& ray, const SampleRange& wanted, RayProgress& state) const {
    const RayInterval t = withinScene(scene_, ray);
    const SampleRange inScene = samplesIn(t, scene_.step), range = inScene.both(wanted);
    const bool isBetween = passesBetween(scene_, t, inScene, wanted);
    if (!(range.first <= range.last) && !isBetween) return;
    // Counted by integers, which grow however large the number of a sample is.
    const int end =
        isBetween ? 1 : range.countTo(range.last) + (inScene.last < wanted.last ? 2 : 1);
    const PartRange inside = partsIn(t, scene_.step, range.first);
    Way way{ray, range, inside, indexOf(range.first) - kSegmentParts,
            range.first + scene_.view.before / scene_.step};
    int part = isBetween ? state.parts.divide(kSegmentParts) : kSegmentParts;
    while (part <= end * kSegmentParts && scene_.rule.open(state.ray))
      part = advance(way, part, state);
  }
  /// The index of a sample, counted from where rays begin.
  static std::uint32_t indexOf(double sample) {
    return (sampleNumber(sample).index + 1u) * kSegmentParts;
  }

 private:
  /// What a ray has through all its samples, and the brick of the last one.
  struct Way {
    const Ray& ray;
    const SampleRange& range;
    PartRange inside;
    std::uint32_t firstIndex;  ///< SampleNumber::index of part 0
    double firstFromEye;       ///< number of the first sample, counted from the eye
    Coord brick{};
    const VoxelSampler::Corners* corners = nullptr;
    bool hasBrick = false;
    int endPart = -1;  ///< of the segment that was divided last, and the value there
    float endValue = 0.0f;

    void enter(const VoxelSampler& sampler, Coord entered) {
      if (hasBrick && entered == brick) return;
      brick = entered, corners = sampler.find(entered), hasBrick = true;
    }
  };

  /// Adds a part to the ray (RayParts); part kSegmentParts is the first sample of the range.
  /// \return the next part to visit
  int advance(Way& way, int part, RayProgress& state) const {
    const Ray& ray = way.ray;
    const SampleRange& range = way.range;
    const double fromFirst = double(part) / kSegmentParts - 1.0, sample = range.first + fromFirst;
    const Vec3 place = sum(ray.origin, scaled(ray.direction, sample * scene_.step));
    const Cell cell = cellOf(place);
    const auto brick = brickOf(cell.voxel);
    way.enter(sampler_, brick);
    const VoxelSampler::Corners* const corners = way.corners;
    if (corners == nullptr && state.ray.last == RayState::kNone && !state.parts.divided) {
      const int behind = range.countTo(behindBrick(ray, brick, scene_.step)) + 1;
      return std::max(part + kSegmentParts, behind * kSegmentParts);
    }
    const bool isThere = corners != nullptr && part >= way.inside.first && part <= way.inside.last;
    const float value = part == way.endPart ? way.endValue
                        : isThere           ? sampler_.interpolate(*corners, cell)
                                            : scene_.rule.background;
    const auto apart = std::uint32_t(state.parts.apart());
    const SampleNumber number{float(way.firstFromEye + fromFirst),
                              way.firstIndex + std::uint32_t(part), apart,
                              float(apart) / float(kSegmentParts)};
    const BrickSample added{nullptr, {}, {}, value, number};
    const auto shade = [&] { return shadeAt(ray, place, *corners, brick); };
    const int next = scene_.isShaded
                         ? brick_march::addSample(scene_.rule, added, part, state,
                                                  Adding<decltype(shade)>{shade})
                         : brick_march::addSample(scene_.rule, added, part, state, UnlitSamples{});
    if (next < part) way.endPart = part, way.endValue = value;
    return next;
  }
  /// Adds samples that are lit by their gradients in the volume.
  template <class ShadeAt>
  struct Adding {
    const ShadeAt& shadeAt;

    void add(const SampleRule& rule, const BrickSample& sample, RayProgress& at) const {
      const Shade shade = shadeAt();
      rule.add(at.ray, sample.value, sample.number, Shades{at.shade, shade});
      at.shade = shade;
    }
    void addEmpty(const SampleRule& rule, float length, RayProgress& at) const {
      rule.addEmpty(at.ray, Shades{at.shade, at.shade}, length);
    }
  };
  [[nodiscard]] Shade shadeAt(const Ray& ray, const Vec3& place,
                              const VoxelSampler::Corners& corners, Coord brick) const {
    const Coord corner = brick * kBrickSide;
    const Vec3 low = pointOf(corner);
    const auto valueAt = [&](const FloatPlace& p) {
      return sampler_.interpolate(corners, cellIn(corner, p));
    };
    const FloatPlace gradient =
        gradientAt(floatPlace(difference(place, low)), float(kBrickSide), valueAt);
    return scene_.light.shadeOf(gradient, floatPlace(scene_.view.inCameraSpace(ray.direction)));
  }
  /// The cell of a place relative to a brick, also on the brick's upper faces.
  static Cell cellIn(Coord corner, const FloatPlace& p) {
    constexpr int kLast = kBrickSide - 1;
    const Coord local{std::min(int(p.x), kLast), std::min(int(p.y), kLast),
                      std::min(int(p.z), kLast)};
    return {corner + local, {p.x - float(local.x), p.y - float(local.y), p.z - float(local.z)}};
  }

  VoxelSampler sampler_;
  MarchScene scene_;
};

/// A box that contains all voxels of a volume.
PlaceBox boxOf(const SparseVolume& volume) {
  Box box;
  for (const Coord brick : volume.bricks) box.expand(brick);
  if (box.empty()) return kNoPlaces;
  const Coord low = volume.origin + box.min * kBrickSide;
  const Coord high = volume.origin + (box.max + Coord{1, 1, 1}) * kBrickSide;
  return {{double(low.x) - 1.0, double(low.y) - 1.0, double(low.z) - 1.0},
          {double(high.x), double(high.y), double(high.z)}};
}

/// A volume at the levels of detail of a picture.
class VolumePicture {
 public:
  VolumePicture(VolumeLevels& levels, const RenderOptions& options, const Picture& picture)
      : bounds_(levelBounds(options, picture.view, boxOf(levels[0]))),
        tables_(picture, options, bounds_) {
    checkRayLength(binsWithin(boxOf(levels[0]), picture.view, options.step));
    levels.prepare(bounds_.last);
    const float background = levels[0].background;
    for (int level = bounds_.first; level <= bounds_.last; ++level)
      marches_.emplace_back(
          levels[level], LevelFrame{level},
          marchScene(options, picture.view, sampleRule(options, tables_.view(level), background)));
  }

  [[nodiscard]] PixelColor operator()(int column, int row) const {
    RayProgress state;
    for (int level = bounds_.first; level <= bounds_.last; ++level) {
      const RayMarch& march = marches_[std::size_t(level - bounds_.first)];
      march.march(march.scene().view.ray(column, row), rangeOf(level), state);
      if (level == bounds_.last || !march.scene().rule.open(state.ray))
        return march.scene().rule.finished(state.ray, Shades{state.shade, state.shade});
      passOn(march.scene().rule, level, state);
    }
    return {};
  }

 private:
  /// The samples of a level, by its own numbers. The one at which the next level begins belongs to
  /// both levels, so that the segment before it is drawn in the nearer one.
  [[nodiscard]] SampleRange rangeOf(int level) const {
    const double side = LevelFrame{level}.side();
    const double first =
        level == bounds_.first ? 0.0 : bounds_.begin[std::size_t(level)] / side + 1.0;
    return {first, bounds_.begin[std::size_t(level) + 1] / side};
  }
  void passOn(const SampleRule& rule, int level, RayProgress& state) const {
    const double shared = bounds_.begin[std::size_t(level) + 1], side = LevelFrame{level}.side();
    rule.passOn(state.ray, RayMarch::indexOf(shared / side),
                RayMarch::indexOf(shared / (2.0 * side)), Shades{state.shade, state.shade});
    state.parts = {2.0f * state.parts.change};  // steps become twice as long
  }

  LevelBounds bounds_;
  LevelTables tables_;
  std::vector<RayMarch> marches_;
};

}  // namespace

Image renderLevels(VolumeLevels& levels, const RenderOptions& options) {
  Picture picture(options, boxOf(levels[0]));
  if (levels[0].bricks.empty()) return picture.take();
  const VolumePicture pixel(levels, options, picture);
  parallelFor(tbb::blocked_range<int>(0, options.resolution.height), [&](const auto& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row)
      for (int column = 0; column < options.resolution.width; ++column) {
        checkCancelled(options);  // a single ray may take a tenth of a second
        picture.set(column, row, pixel(column, row));
      }
  });
  return picture.take();
}

Image renderVolume(const SparseVolume& volume, const RenderOptions& options) {
  VolumeLevels levels(volume);
  return renderLevels(levels, options);
}

}  // namespace esvr
