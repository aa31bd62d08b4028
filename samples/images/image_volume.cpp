#include "images/image_volume.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

#include "esvr/error.h"

namespace esvr::samples {
namespace {

/// Visits an image from bottom to top, eight slices at a time.
template <class Visit>
void forEachSlab(ImageSource& image, const CancelToken* cancel, Visit visit) {
  const Coord size = image.size();
  std::vector<float> values;
  for (std::int32_t z = 0; z < size.z; z += kBrickSide) {
    if (cancel && cancel->cancelled()) throw Cancelled();
    const Slab slab{z, std::min<std::int32_t>(kBrickSide, size.z - z)};
    values.resize(std::size_t(size.x) * std::size_t(size.y) * std::size_t(slab.slices));
    image.read(slab, values);
    visit(slab, values);
  }
}

double largestMagnitude(ImageSource& image, const CancelToken* cancel) {
  double largest = 0.0;
  forEachSlab(image, cancel, [&](const Slab&, std::span<const float> values) {
    for (const float value : values)
      if (std::isfinite(value)) largest = std::max(largest, std::abs(double(value)));
  });
  return largest;
}

double scaleOf(ImageSource& image, const ImageOptions& options, const CancelToken* cancel) {
  if (!options.normalise) return 1.0;
  const auto typeMaximum = image.typeMaximum();
  const double largest = typeMaximum ? *typeMaximum : largestMagnitude(image, cancel);
  if (largest == 0.0) throw BadInput("every voxel is 0, so the image cannot be normalised");
  return 1.0 / largest;
}

/// Counts the values that are not finite and replaces them by 0.
class NonFiniteFilter {
 public:
  explicit NonFiniteFilter(Coord size) : size_(size) {}

  void clean(const Slab& slab, std::span<float> values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::isfinite(values[i])) continue;
      if (count_++ == 0) first_ = voxel(slab, i);
      values[i] = 0.0f;
    }
  }
  [[nodiscard]] std::uint64_t count() const { return count_; }
  void refuse() const {
    if (count_ > 0)
      throw BadInput(std::to_string(count_) + " voxels are not finite, the first at " +
                     toString(first_) + " (--nonfinite zero replaces them)");
  }

 private:
  [[nodiscard]] Coord voxel(const Slab& slab, std::size_t i) const {
    const auto width = std::size_t(size_.x), height = std::size_t(size_.y);
    return {std::int32_t(i % width), std::int32_t(i / width % height),
            slab.firstZ + std::int32_t(i / width / height)};
  }

  Coord size_;
  std::uint64_t count_ = 0;
  Coord first_;
};

/// Converts slabs to the bricks of a volume.
class BrickMaker {
 public:
  BrickMaker(Coord size, const ImageOptions& options, double scale, std::uint64_t maxBricks)
      : size_(size), options_(options), scale_(scale), maxBricks_(maxBricks) {}

  void add(const Slab& slab, std::span<const float> values) {
    const Coord bricks = brickOf(size_ + Coord{kBrickSide - 1, kBrickSide - 1, 0});
    tbb::parallel_for(0, bricks.x, [&](std::int32_t x) {
      for (std::int32_t y = 0; y < bricks.y; ++y)
        addBrick({x * kBrickSide, y * kBrickSide, slab.firstZ}, slab, values);
    });
    std::size_t found = 0;
    for (const auto& part : parts_) found += part.size();
    if (found > maxBricks_)
      throw DeviceError("the volume has more than " + std::to_string(maxBricks_) +
                        " bricks of 8^3 voxels, which is more than fits into memory: a threshold "
                        "leaves fewer");
  }

  SparseVolume finish() {
    std::vector<BrickInput> all;
    for (auto& part : parts_) {
      std::move(part.begin(), part.end(), std::back_inserter(all));
      part = {};
    }
    return makeVolume(std::move(all), background());
  }

 private:
  [[nodiscard]] float background() const { return float(options_.background * scale_); }
  [[nodiscard]] bool isActive(float value) const {
    return options_.threshold ? double(value) >= *options_.threshold
                              : double(value) != options_.background;
  }

  void addBrick(Coord corner, const Slab& slab, std::span<const float> values) {
    BrickInput brick{.corner = corner, .values = {}, .active = {}};
    brick.values.fill(background());
    bool any = false;
    const Coord end = minCoord(corner + Coord{kBrickSide, kBrickSide, slab.slices}, size_);
    for (std::int32_t z = corner.z; z < end.z; ++z)
      for (std::int32_t y = corner.y; y < end.y; ++y)
        for (std::int32_t x = corner.x; x < end.x; ++x) {
          const auto row = std::size_t(z - slab.firstZ) * std::size_t(size_.y) + std::size_t(y);
          const float value = values[row * std::size_t(size_.x) + std::size_t(x)];
          if (!isActive(value)) continue;
          const int offset = voxelOffset(localOf({x, y, z}));
          brick.values[std::size_t(offset)] = float(double(value) * scale_);
          brick.active.set(offset);
          any = true;
        }
    if (any) parts_.local().push_back(brick);
  }

  Coord size_;
  const ImageOptions& options_;
  double scale_;
  std::uint64_t maxBricks_;
  tbb::enumerable_thread_specific<std::vector<BrickInput>> parts_;
};

}  // namespace

ImageVolume volumeOf(ImageSource& image, const ImageOptions& options, const Limits& limits) {
  NonFiniteFilter filter(image.size());
  BrickMaker maker(image.size(), options, scaleOf(image, options, limits.cancel), limits.maxBricks);
  forEachSlab(image, limits.cancel, [&](const Slab& slab, std::span<float> values) {
    filter.clean(slab, values);
    maker.add(slab, values);
  });
  if (!options.zeroNonFinite) filter.refuse();
  return {maker.finish(), filter.count()};
}

}  // namespace esvr::samples
