#include "convert/motion_estimate.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/axes.h"
#include "core/parallel.h"

namespace esvr::convert {
namespace {

constexpr std::size_t kLevels = 4;  // from voxels to means of 8^3 voxels
constexpr int kIterationsOfLevel = 3;
/// Largest change of a motion in an iteration, in voxels of the level: gradients tell no more.
constexpr double kLargestChange = 1.0;
/// Share of the mean curvature of all windows that is added to that of a window, so that motions
/// change little where there is nothing to see.
constexpr double kDamping = 0.1;

Coord halfOf(Coord c) { return {c.x >> 1, c.y >> 1, c.z >> 1}; }

/// Coordinates of a brick from the origin of the index space, in bricks.
Coord absoluteBrick(const SparseVolume& volume, std::size_t b) {
  return brickOf(volume.brickCorner(b));
}

std::vector<Coord> absoluteBricks(const SparseVolume& volume) {
  std::vector<Coord> bricks(volume.brickCount());
  for (std::size_t b = 0; b < bricks.size(); ++b) bricks[b] = absoluteBrick(volume, b);
  return bricks;
}

/// Adds the means of 2^3 voxels of a brick to the brick of the coarser level.
void addMeans(std::span<const float> values, Coord octant, BrickInput& coarse) {
  constexpr float kShare = 1.0f / 8.0f;
  for (int v = 0; v < kBrickVoxels; ++v) {
    const Coord to = octant * (kBrickSide / 2) + halfOf(voxelLocal(v));
    coarse.values[std::size_t(voxelOffset(to))] += kShare * values[std::size_t(v)];
  }
}

/// The volume with voxels that are the means of 2^3 voxels.
SparseVolume halved(const SparseVolume& volume) {
  std::map<Coord, BrickInput> coarse;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    const Coord brick = absoluteBrick(volume, b), parent = halfOf(brick);
    auto [at, isNew] = coarse.try_emplace(parent);
    if (isNew) {
      at->second.corner = parent * kBrickSide;
      at->second.values.fill(volume.background);
      at->second.active.setAll();
    }
    const Coord octant = brick - parent * 2;
    for (int v = 0; v < kBrickVoxels / 8; ++v) {
      const Coord local{v >> 4, (v >> 2) & 3, v & 3};
      at->second.values[std::size_t(voxelOffset(octant * (kBrickSide / 2) + local))] = 0.0f;
    }
    addMeans(volume.brickValues(b), octant, at->second);
  }
  std::vector<BrickInput> bricks;
  for (auto& [parent, brick] : coarse) bricks.push_back(brick);
  return makeVolume(std::move(bricks), volume.background);
}

/// Voxels of a volume around a brick that was displaced: kSide^3 values, from one voxel before its
/// first voxel.
class Patch {
 public:
  static constexpr int kSide = kBrickSide + 3;
  static constexpr int kStep[3] = {kSide * kSide, kSide, 1};

  Patch(const SparseVolume& volume, const BrickIndex& index, Coord corner) {
    values_.fill(volume.background);
    const Coord first = corner - Coord{1, 1, 1}, last = first + Coord{1, 1, 1} * (kSide - 1);
    const Coord low = brickOf(first), high = brickOf(last);
    for (std::int32_t x = low.x; x <= high.x; ++x)
      for (std::int32_t y = low.y; y <= high.y; ++y)
        for (std::int32_t z = low.z; z <= high.z; ++z)
          if (const auto b = index.find({x, y, z}); b != BrickIndex::kNone)
            copy(volume.brickValues(b), Coord{x, y, z} * kBrickSide, Box{first, last});
  }

  /// Values at a place between voxels, by trilinear interpolation.
  /// \param at  index of the voxel below the place
  [[nodiscard]] double interpolated(int at, const Vector3& f) const {
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const int x = corner >> 2, y = (corner >> 1) & 1, z = corner & 1;
      const double weight = (x ? f[0] : 1 - f[0]) * (y ? f[1] : 1 - f[1]) * (z ? f[2] : 1 - f[2]);
      sum += weight * double(values_[std::size_t(at + x * kStep[0] + y * kStep[1] + z)]);
    }
    return sum;
  }

  static int indexOf(Coord local) {
    return (local.x + 1) * kStep[0] + (local.y + 1) * kStep[1] + local.z + 1;
  }

 private:
  void copy(std::span<const float> brick, Coord corner, const Box& box) {
    const Box both = common(box, {corner, corner + Coord{7, 7, 7}});
    for (std::int32_t x = both.min.x; x <= both.max.x; ++x)
      for (std::int32_t y = both.min.y; y <= both.max.y; ++y)
        for (std::int32_t z = both.min.z; z <= both.max.z; ++z) {
          const Coord to = Coord{x, y, z} - box.min;
          values_[std::size_t(to.x * kStep[0] + to.y * kStep[1] + to.z)] =
              brick[std::size_t(voxelOffset(Coord{x, y, z} - corner))];
        }
  }

  std::array<float, std::size_t(kSide) * kSide * kSide> values_;
};

/// The normal equations of a displacement: the upper half of H, by rows, and the right side.
struct Normal {
  std::array<double, 6> h{};
  Vector3 right{};

  void add(const Normal& other, double weight) {
    for (std::size_t k = 0; k < 6; ++k) h[k] += weight * other.h[k];
    for (std::size_t k = 0; k < 3; ++k) right[k] += weight * other.right[k];
  }
  [[nodiscard]] double trace() const { return h[0] + h[3] + h[5]; }

  /// The solution with `damping` added to the diagonal, by the adjugate.
  [[nodiscard]] Vector3 solve(double damping) const {
    const double a = h[0] + damping, b = h[1], c = h[2], d = h[3] + damping, e = h[4],
                 f = h[5] + damping;
    const double aa = d * f - e * e, ab = c * e - b * f, ac = b * e - c * d, bb = a * f - c * c,
                 bc = b * c - a * e, cc = a * d - b * b;
    const double determinant = a * aa + b * ab + c * ac;
    if (!(determinant > 0.0)) return {};
    const auto row = [&](double x, double y, double z) {
      return (x * right[0] + y * right[1] + z * right[2]) / determinant;
    };
    return {row(aa, ab, ac), row(ab, bb, bc), row(ac, bc, cc)};
  }
};

/// Two frames of one level, and the motion between them.
class FramePair {
 public:
  FramePair(const SparseVolume& before, const SparseVolume& now)
      : before_(before),
        now_(now),
        bricks_(absoluteBricks(before)),
        beforeIndex_(bricks_),
        nowIndex_(absoluteBricks(now)),
        motions_(bricks_.size()) {}

  /// \param coarser  the motion of the level with half the resolution
  void begin(const MotionField& coarser) {
    for (std::size_t b = 0; b < bricks_.size(); ++b) {
      const Coord middle = bricks_[b] * kBrickSide + Coord{4, 4, 4};
      motions_[b] = coarser.at({middle.x * 0.5, middle.y * 0.5, middle.z * 0.5});
      for (double& m : motions_[b]) m *= 2.0;
    }
  }

  void improve() {
    std::vector<Normal> normals(bricks_.size());
    parallelFor(std::size_t{0}, bricks_.size(), [&](std::size_t b) { normals[b] = normalOf(b); });
    double trace = 0.0;
    for (const Normal& n : normals) trace += n.trace();
    const double damping =
        std::max(kDamping * trace / double(std::max<std::size_t>(bricks_.size(), 1)), 1e-300);
    parallelFor(std::size_t{0}, bricks_.size(), [&](std::size_t b) {
      const Vector3 change = window(normals, b).solve(damping);
      for (std::size_t a = 0; a < 3; ++a)
        motions_[b][a] += std::clamp(change[a], -kLargestChange, kLargestChange);
    });
  }

  [[nodiscard]] MotionField field() const { return {bricks_, motions_}; }

 private:
  [[nodiscard]] Normal normalOf(std::size_t b) const {
    const Vector3& motion = motions_[b];
    Coord whole;
    Vector3 part{};
    for (std::size_t a = 0; a < 3; ++a) {
      const double floor = std::floor(motion[a]);
      whole.*kAxes[a] = std::int32_t(floor);
      part[a] = motion[a] - floor;
    }
    const Patch patch(now_, nowIndex_, bricks_[b] * kBrickSide + whole);
    const auto values = before_.brickValues(b);
    Normal normal;
    for (int v = 0; v < kBrickVoxels; ++v) {
      const int at = Patch::indexOf(voxelLocal(v));
      Vector3 g;
      for (std::size_t a = 0; a < 3; ++a)
        g[a] = 0.5 * (patch.interpolated(at + Patch::kStep[a], part) -
                      patch.interpolated(at - Patch::kStep[a], part));
      const double error = double(values[std::size_t(v)]) - patch.interpolated(at, part);
      normal.add({{g[0] * g[0], g[0] * g[1], g[0] * g[2], g[1] * g[1], g[1] * g[2], g[2] * g[2]},
                  {g[0] * error, g[1] * error, g[2] * error}},
                 1.0);
    }
    return normal;
  }

  /// The sum over a brick and those around it.
  [[nodiscard]] Normal window(const std::vector<Normal>& normals, std::size_t b) const {
    Normal sum;
    for (std::int32_t x = -1; x <= 1; ++x)
      for (std::int32_t y = -1; y <= 1; ++y)
        for (std::int32_t z = -1; z <= 1; ++z) {
          const auto n = beforeIndex_.find(bricks_[b] + Coord{x, y, z});
          const double weight = std::ldexp(1.0, -std::abs(x) - std::abs(y) - std::abs(z));
          if (n != BrickIndex::kNone) sum.add(normals[n], weight);
        }
    return sum;
  }

  const SparseVolume &before_, &now_;
  std::vector<Coord> bricks_;
  BrickIndex beforeIndex_, nowIndex_;
  std::vector<Vector3> motions_;
};

}  // namespace

MotionField::MotionField(std::vector<Coord> bricks, std::vector<Vector3> motions)
    : index_(bricks), motions_(std::move(motions)) {}

Vector3 MotionField::at(const Vector3& place) const {
  Coord low;
  Vector3 part{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double bricks = place[a] / kBrickSide - 0.5;
    const double floor = std::floor(bricks);
    low.*kAxes[a] = std::int32_t(floor);
    part[a] = bricks - floor;
  }
  Vector3 sum{};
  double weights = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Coord step{corner >> 2, (corner >> 1) & 1, corner & 1};
    const auto b = index_.find(low + step);
    if (b == BrickIndex::kNone) continue;
    double weight = 1e-6;  // a place at the middle of a missing brick has the motion of the others
    weight += (step.x ? part[0] : 1 - part[0]) * (step.y ? part[1] : 1 - part[1]) *
              (step.z ? part[2] : 1 - part[2]);
    for (std::size_t a = 0; a < 3; ++a) sum[a] += weight * motions_[b][a];
    weights += weight;
  }
  if (weights > 0.0)
    for (double& s : sum) s /= weights;
  return sum;
}

MotionField estimateMotion(const SparseVolume& before, const SparseVolume& now) {
  // Pointers to coarser volumes stay valid, because the vectors do not grow beyond their capacity.
  std::vector<SparseVolume> coarser;
  coarser.reserve(2 * (kLevels - 1));
  std::vector<std::pair<const SparseVolume*, const SparseVolume*>> levels{{&before, &now}};
  while (levels.size() < kLevels) {
    const auto [finerBefore, finerNow] = levels.back();
    const SparseVolume& a = coarser.emplace_back(halved(*finerBefore));
    const SparseVolume& b = coarser.emplace_back(halved(*finerNow));
    levels.emplace_back(&a, &b);
  }
  MotionField motion({}, {});
  for (std::size_t level = levels.size(); level-- > 0;) {
    FramePair frames(*levels[level].first, *levels[level].second);
    if (level + 1 < levels.size()) frames.begin(motion);
    for (int n = 0; n < kIterationsOfLevel; ++n) frames.improve();
    motion = frames.field();
  }
  return motion;
}

Field moved(Field field, const MotionField& motion) {
  for (Chunk& chunk : field.chunks) {
    auto& center = chunk.ellipsoids.center;
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i) {
      const Vector3 by =
          motion.at({double(chunk.origin.x) + center[0][i], double(chunk.origin.y) + center[1][i],
                     double(chunk.origin.z) + center[2][i]});
      for (std::size_t a = 0; a < 3; ++a) center[a][i] += float(by[a]);
    }
  }
  return field;
}

}  // namespace esvr::convert
