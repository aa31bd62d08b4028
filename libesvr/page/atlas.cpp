#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "capi/objects.h"
#include "page/page.h"
#include "render/cell_bricks.h"

namespace esvr::page {
namespace {

constexpr int kMostSlots = 255;     ///< places along an axis that a byte of the table can hold
constexpr int kTableBytes = 4;      ///< bytes of a brick's entry in the table
constexpr int kCoarsestLevel = 16;  ///< every volume is a single brick long before

/// The size of an atlas that is about a cube and has room for `count` slots; nothing if it would be
/// too large.
std::optional<Coord> slotsFor(std::size_t count, int mostSide) {
  const int most = std::min(kMostSlots, mostSide / kCellBrickSide);
  const auto ceilOf = [](double a) { return std::max(1, int(std::ceil(a))); };
  const int x = std::min(most, ceilOf(std::cbrt(double(count))));
  const int y = std::min(most, ceilOf(std::sqrt(double(count) / x)));
  const int z = ceilOf(double(count) / x / y);
  return z <= most ? std::optional(Coord{x, y, z}) : std::nullopt;
}

/// Distances, in bricks along the axis that is farthest, to the nearest brick that is not empty.
class Distances {
 public:
  Distances(Coord size, const std::vector<Coord>& occupied)
      : size_(size), of_(std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z), kFar) {
    for (const Coord brick : occupied) of_[at(brick)] = 0;
    // The largest of three distances along axes: one pass for each axis and direction suffices,
    // because a step along an axis may be combined with steps along the axes before it.
    for (int axis = 0; axis < 3; ++axis) spread(axis);
  }
  [[nodiscard]] std::size_t at(Coord b) const {
    return (std::size_t(b.z) * std::size_t(size_.y) + std::size_t(b.y)) * std::size_t(size_.x) +
           std::size_t(b.x);
  }
  [[nodiscard]] const std::vector<std::uint8_t>& all() const { return of_; }

 private:
  static constexpr std::uint8_t kFar = 255;

  /// Chebyshev distance is separable: d(x) = min over x' of max(|x - x'|, d(x')).
  void spread(int axis) {
    const std::size_t step = axis == 0   ? 1
                             : axis == 1 ? std::size_t(size_.x)
                                         : std::size_t(size_.x) * std::size_t(size_.y);
    const int length = axis == 0 ? size_.x : (axis == 1 ? size_.y : size_.z);
    for (std::size_t first = 0; first < of_.size(); ++first)
      if (first / step % std::size_t(length) == 0) spreadLine(&of_[first], step, length);
  }
  void spreadLine(std::uint8_t* line, std::size_t step, int length) {
    line_.resize(std::size_t(length));
    for (int i = 0; i < length; ++i) line_[std::size_t(i)] = line[std::size_t(i) * step];
    for (int i = 0; i < length; ++i) line[std::size_t(i) * step] = nearest(i, length);
  }
  [[nodiscard]] std::uint8_t nearest(int i, int length) const {
    int best = line_[std::size_t(i)];
    for (int r = 1; r < best; ++r) {
      const int below = i >= r ? line_[std::size_t(i - r)] : kFar;
      const int above = i + r < length ? line_[std::size_t(i + r)] : kFar;
      best = std::min(best, std::max(r, std::min(below, above)));
    }
    return std::uint8_t(best);
  }

  Coord size_;
  std::vector<std::uint8_t> of_;
  std::vector<std::uint8_t> line_;
};

/// An atlas with the memory of its textures.
struct Atlas : page_atlas {
  std::vector<std::uint8_t> bytes;
  std::vector<float> shares;
};

void set(int (&to)[3], Coord c) { to[0] = c.x, to[1] = c.y, to[2] = c.z; }

/// The largest difference from the background, or 1 if there is none.
float scaleOf(const BrickAtlas& from, float background) {
  float largest = 0.0f;
  for (const float v : from.values) largest = std::max(largest, std::fabs(v - background));
  return largest > 0.0f ? largest : 1.0f;
}

class AtlasMaker {
 public:
  AtlasMaker(const BrickAtlas& from, const Box& box, Coord slots) : from_(from), box_(box) {
    set(atlas_->slots, slots);
  }

  std::unique_ptr<Atlas> make(float background, int level) {
    Atlas& a = *atlas_;
    a.level = level;
    set(a.origin, box_.min * kBrickSide);
    set(a.bricks, box_.max - box_.min + Coord{1, 1, 1});
    a.count = int(from_.table.bricks.size());
    a.background = background;
    a.scale = scaleOf(from_, background);
    fillTable();
    fillVoxels();
    const auto [least, most] = std::minmax_element(a.shares.begin(), a.shares.end());
    a.least = *least, a.most = *most;
    a.table = a.bytes.data(), a.voxels = a.shares.data();
    return std::move(atlas_);
  }

 private:
  [[nodiscard]] Coord brickAt(std::size_t i) const { return from_.table.place(i) - box_.min; }
  [[nodiscard]] Coord slotOf(std::size_t i) const {
    const int n = int(i), x = atlas_->slots[0], y = atlas_->slots[1];
    return {n % x, n / x % y, n / x / y};
  }

  void fillTable() {
    std::vector<Coord> bricks;
    for (std::size_t i = 0; i < from_.table.bricks.size(); ++i) bricks.push_back(brickAt(i));
    const int(&size)[3] = atlas_->bricks;
    const Distances distances({size[0], size[1], size[2]}, bricks);
    auto& bytes = atlas_->bytes;
    bytes.resize(distances.all().size() * kTableBytes);
    for (std::size_t b = 0; b < distances.all().size(); ++b)
      bytes[b * kTableBytes + 3] = distances.all()[b];
    for (std::size_t i = 0; i < bricks.size(); ++i) {
      std::uint8_t* const entry = &bytes[distances.at(bricks[i]) * kTableBytes];
      const Coord slot = slotOf(i);
      entry[0] = std::uint8_t(slot.x), entry[1] = std::uint8_t(slot.y);
      entry[2] = std::uint8_t(slot.z);
    }
  }

  void fillVoxels() {
    const int(&slots)[3] = atlas_->slots;
    width_ = std::size_t(slots[0] * kCellBrickSide),
    height_ = std::size_t(slots[1] * kCellBrickSide);
    atlas_->shares.assign(width_ * height_ * std::size_t(slots[2] * kCellBrickSide), 0);
    for (std::size_t i = 0; i < from_.table.bricks.size(); ++i)
      fillSlot(&from_.values[i * kCellBrickVoxels], slotOf(i) * kCellBrickSide);
  }
  /// \param from  voxels of a brick, z fastest
  void fillSlot(const float* from, Coord first) {
    const float perScale = 1.0f / atlas_->scale;
    for (int x = 0; x < kCellBrickSide; ++x)
      for (int y = 0; y < kCellBrickSide; ++y)
        for (int z = 0; z < kCellBrickSide; ++z) {
          const Coord to = first + Coord{x, y, z};
          const float share = (*from++ - atlas_->background) * perScale;
          atlas_->shares[(std::size_t(to.z) * height_ + std::size_t(to.y)) * width_ +
                         std::size_t(to.x)] = share;
        }
  }

  const BrickAtlas& from_;
  Box box_;
  std::size_t width_ = 0, height_ = 0;
  std::unique_ptr<Atlas> atlas_ = std::make_unique<Atlas>();
};

Box boxOf(const BrickAtlas& atlas) {
  Box box;
  for (std::size_t i = 0; i < atlas.table.bricks.size(); ++i) box.expand(atlas.table.place(i));
  if (box.empty()) box.expand(Coord{});
  return box;
}

/// An atlas of a volume; null if its textures would be too large.
std::unique_ptr<Atlas> atlasOf(const SparseVolume& volume, int level, int mostSide,
                               double mostBytes) {
  // The bricks of voxels tell early that an atlas would be too large. An atlas has more bricks.
  const double perBrick = kCellBrickVoxels * sizeof(float);
  if (double(volume.brickCount()) * perBrick > mostBytes) return nullptr;
  const BrickAtlas bricks = makeBrickAtlas(volume);
  const Box box = boxOf(bricks);
  const auto slots = slotsFor(bricks.table.bricks.size(), mostSide);
  const Coord size = box.max - box.min + Coord{1, 1, 1};
  if (!slots || std::max({size.x, size.y, size.z}) > mostSide) return nullptr;
  const double slotCount = double(slots->x) * slots->y * slots->z;
  if (slotCount * perBrick + box.volume() * kTableBytes > mostBytes) return nullptr;
  return AtlasMaker(bricks, box, *slots).make(volume.background, level);
}

std::unique_ptr<Atlas> makeAtlas(const SparseVolume& volume, int level, int mostSide,
                                 double mostBytes) {
  VolumeLevels levels(volume);
  for (; level <= kCoarsestLevel; ++level) {
    levels.prepare(level);
    if (auto atlas = atlasOf(levels[level], level, mostSide, mostBytes)) return atlas;
  }
  throw MemoryExceeded("the volume is too large for this page");
}

}  // namespace
}  // namespace esvr::page

using namespace esvr;

page_atlas* page_make_atlas(const esvr_volume* volume, int level, int most_side,
                            double most_bytes) {
  std::unique_ptr<page::Atlas> atlas;
  (void)capi::guarded(
      [&] { atlas = page::makeAtlas(volume->voxels, level, most_side, most_bytes); });
  return atlas.release();
}

void page_free_atlas(page_atlas* atlas) { delete static_cast<page::Atlas*>(atlas); }
