#include "fit/chunks/chunk_target.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/axes.h"
#include "core/brick_index.h"
#include "core/parallel.h"
#include "esvr/field.h"
#include "fit/export_field.h"
#include "fit/tuning.h"

namespace esvr {
namespace {

/// The voxels of a box of bricks, as far as coordinates reach.
Box voxelsOf(const Box& bricks) {
  const auto bounded = [](std::int64_t coordinate) {
    return std::int32_t(std::clamp<std::int64_t>(coordinate, Box::kMin, Box::kMax));
  };
  Box box;
  for (const auto axis : kAxes) {
    box.min.*axis = bounded(std::int64_t{bricks.min.*axis} * kBrickSide);
    box.max.*axis = bounded((std::int64_t{bricks.max.*axis} + 1) * kBrickSide - 1);
  }
  return box;
}

/// The sums of ellipsoids in the bricks of a target; empty if they reach none.
std::vector<float> sumsIn(const FitTarget& target, const Ghosts& ghosts) {
  const Field field = exportField(ghosts.ellipsoids, {{}, 1.0, 0.0f, ghosts.kernel});
  const BrickIndex index(target.bricks);
  std::vector<Coord> corners;
  for (const Coord corner : reachedBricks(field, voxelsOf(index.bounds())))
    if (index.find(brickOf(corner)) != BrickIndex::kNone) corners.push_back(corner);
  if (corners.empty()) return {};
  std::vector<float> values(corners.size() * kBrickVoxels);
  evaluateBricks(field, corners, values);
  std::vector<float> sums(target.values.size());
  parallelFor(std::size_t{0}, corners.size(), [&](std::size_t n) {
    const auto from = values.begin() + std::ptrdiff_t(n * kBrickVoxels);
    const std::size_t b = index.find(brickOf(corners[n]));
    std::copy_n(from, kBrickVoxels, sums.begin() + std::ptrdiff_t(b * kBrickVoxels));
  });
  return sums;
}

}  // namespace

int haloBricks(std::uint64_t activeVoxels, std::size_t count) {
  constexpr double kScales = 2.0;  // largest scale, relative to the distance of ellipsoids
  constexpr int kFewest = 2;
  const double distance = std::cbrt(double(activeVoxels) / double(std::max<std::size_t>(count, 1)));
  const double scale = std::min(kScales * distance, Tuning{}.largestScale);
  const double radius = supportRadius(kernelConstants<double>(Kernel{}));
  return std::max(int(std::ceil(scale * radius / kBrickSide)), kFewest);
}

std::vector<std::uint32_t> bricksAround(const SparseVolume& volume,
                                        std::span<const BrickChunk> chunks, const BrickChunk& chunk,
                                        int halo) {
  const Box around = dilated(chunk.bounds, halo);
  std::vector<std::uint32_t> bricks;
  for (const BrickChunk& other : chunks) {
    if (common(around, other.bounds).empty()) continue;
    for (const std::uint32_t b : other.bricks)
      if (around.contains(volume.bricks[b])) bricks.push_back(b);
  }
  std::ranges::sort(bricks);
  return bricks;
}

Box boxOf(const ChunkScene& scene, const BrickChunk& chunk) {
  return common(scene.box, voxelsOf(chunk.box));
}

void makeChunkTarget(const ChunkScene& scene, const BrickChunk& chunk, const Ghosts& ghosts,
                     ChunkTarget& out) {
  const SparseVolume& volume = scene.volume;
  const auto bricks = bricksAround(volume, scene.chunks, chunk, scene.halo);
  out.target = makeTarget({volume, bricks}, boxOf(scene, chunk), scene.scale);
  for (const std::uint32_t b : bricks)
    out.counted.push_back(chunk.box.contains(volume.bricks[b]) ? volume.active[b] : BrickMask{});
  out.target.active = &out.counted;
  out.target.largestScale =
      scene.halo * kBrickSide / supportRadius(kernelConstants<double>(ghosts.kernel));
  out.target.within = dilated(chunk.bounds, scene.halo);
  out.target.constants = sumsIn(out.target, ghosts);
}

}  // namespace esvr
