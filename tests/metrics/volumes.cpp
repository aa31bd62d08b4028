#include "metrics/volumes.h"

#include <map>

namespace esvr::test {
namespace {

BrickInput emptyBrick(Coord brick, float background) {
  BrickInput input{.corner = brick * kBrickSide, .values = {}, .active = {}};
  input.values.fill(background);
  return input;
}

class VolumeBuilder {
 public:
  explicit VolumeBuilder(float background) : background_(background) {}

  void set(Coord at, float value) {
    const Coord brick = brickOf(at);
    auto& input = bricks_.try_emplace(brick, emptyBrick(brick, background_)).first->second;
    input.values[std::size_t(voxelOffset(localOf(at)))] = value;
    input.active.set(voxelOffset(localOf(at)));
  }
  SparseVolume finish() const {
    std::vector<BrickInput> bricks;
    for (const auto& [brick, input] : bricks_) bricks.push_back(input);
    return makeVolume(std::move(bricks), background_);
  }

 private:
  float background_;
  std::map<Coord, BrickInput> bricks_;
};

BrickInput randomBrick(Coord brick, std::uint64_t seed, const RandomVolumeOptions& options) {
  BrickInput input = emptyBrick(brick, options.background);
  for (int i = 0; i < kBrickVoxels; ++i) {
    const double fate = hashUnit(seed, std::uint64_t(3 * i));
    const auto value = float(2.0 * hashUnit(seed, std::uint64_t(3 * i + 1)) - 0.5);
    if (fate < options.activeShare) input.active.set(i);
    // Some inactive voxels have their own values, as inside a level set.
    const bool keepsValue = fate < options.activeShare + 0.1;
    if (keepsValue) input.values[std::size_t(i)] = value;
  }
  return input;
}

}  // namespace

double hashUnit(std::uint64_t seed, std::uint64_t index) {
  std::uint64_t h = seed * 0x9e3779b97f4a7c15u + index * 0xd1342543de82ef95u + 0x2545f4914f6cdd1du;
  h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
  h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
  return double((h ^ (h >> 32)) >> 11) * 0x1p-53;
}

SparseVolume volumeOf(const std::vector<Voxel>& voxels, float background) {
  VolumeBuilder builder(background);
  for (const Voxel& voxel : voxels) builder.set(voxel.at, voxel.value);
  return builder.finish();
}

SparseVolume volumeOf(const Box& box, const std::function<float(Coord)>& value, float background) {
  VolumeBuilder builder(background);
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) builder.set({x, y, z}, value({x, y, z}));
  return builder.finish();
}

SparseVolume randomVolume(const RandomVolumeOptions& options) {
  std::vector<BrickInput> bricks;
  const int r = options.brickRange;
  std::uint64_t place = 0;
  for (int x = -r; x < r; ++x)
    for (int y = -r; y < r; ++y)
      for (int z = -r; z < r; ++z, ++place)
        if (hashUnit(options.seed, place) < options.brickShare)
          bricks.push_back(randomBrick({x, y, z}, options.seed * 1000003 + place, options));
  return makeVolume(std::move(bricks), options.background);
}

SparseVolume movedBy(SparseVolume volume, Coord by) {
  volume.origin = volume.origin + by;
  return volume;
}

}  // namespace esvr::test
