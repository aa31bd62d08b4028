#include "baselines/voxels.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "esvr/error.h"

namespace esvr::baselines {

namespace {

/// The change of a voxel's value if it is dropped.
float deviation(const VolumeGrid& grid, float value) {
  const auto background = float(grid.descriptor.background);
  return grid.descriptor.gridClass == GridClass::kLevelSet ? std::abs(background) - std::abs(value)
                                                           : std::abs(value - background);
}

/// The part of a brick that lies in a box, in local coordinates.
Box localPart(Coord corner, const Box& box) {
  const Coord last{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1};
  return {maxCoord(box.min - corner, {}), minCoord(box.max - corner, last)};
}

template <class Visit>
void visitVoxels(const Box& local, const Visit& visit) {
  for (int x = local.min.x; x <= local.max.x; ++x)
    for (int y = local.min.y; y <= local.max.y; ++y)
      for (int z = local.min.z; z <= local.max.z; ++z) visit(Coord{x, y, z});
}

/// Appends a brick of the array unless all its voxels are background.
void appendBrick(const DenseBox& dense, Coord corner, float activeAbove, SparseVolume& volume) {
  std::array<float, kBrickVoxels> values;
  values.fill(volume.background);
  BrickMask active;
  bool holdsAny = false;
  visitVoxels(localPart(corner, dense.box), [&](Coord local) {
    const int i = voxelOffset(local);
    values[i] = dense.values[dense.offset(corner + local)];
    const float difference = std::abs(values[i] - volume.background);
    holdsAny |= difference > 0.0f;
    if (difference > activeAbove) active.set(i);
  });
  if (!holdsAny) return;
  volume.bricks.push_back(brickOf(corner - volume.origin));
  volume.values.insert(volume.values.end(), values.begin(), values.end());
  volume.active.push_back(active);
}

constexpr unsigned kDigitBits = 7;
constexpr std::uint64_t kDigitMask = (1u << kDigitBits) - 1, kMore = 1u << kDigitBits;

/// Appends a number in digits of 7 bits; all but the last one have the highest bit.
void appendNumber(std::uint64_t number, std::vector<std::byte>& bytes) {
  for (; number > kDigitMask; number >>= kDigitBits)
    bytes.push_back(std::byte(kMore | (number & kDigitMask)));
  bytes.push_back(std::byte(number));
}

std::uint64_t takeNumber(std::span<const std::byte>& bytes) {
  std::uint64_t number = 0;
  for (unsigned shift = 0; shift < 64 && !bytes.empty(); shift += kDigitBits) {
    const auto digit = std::uint64_t(bytes.front());
    bytes = bytes.subspan(1);
    number |= (digit & kDigitMask) << shift;
    if (digit < kMore) return number;
  }
  throw BadInput("the positions of bricks end too early");
}

/// The number that stands for a brick in another column, where the gap along z has no meaning.
constexpr std::uint64_t kOtherColumn = 0;

}  // namespace

std::vector<float> thresholds(const VolumeGrid& grid) {
  const SparseVolume& volume = grid.volume;
  std::vector<float> all;
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i)
      if (volume.active[b].test(i)) all.push_back(deviation(grid, volume.brickValues(b)[i]));
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

VolumeGrid withoutVoxels(const VolumeGrid& grid, double threshold) {
  const SparseVolume& volume = grid.volume;
  const bool levelSet = grid.descriptor.gridClass == GridClass::kLevelSet;
  std::vector<BrickInput> bricks;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    BrickInput brick{.corner = volume.brickCorner(b), .values = {}, .active = volume.active[b]};
    const auto values = volume.brickValues(b);
    std::ranges::copy(values, brick.values.begin());
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (!brick.active.test(i) || double(deviation(grid, values[i])) > threshold) continue;
      brick.active.words[i >> 6] &= ~(std::uint64_t{1} << (i & 63));
      brick.values[i] = levelSet && values[i] < 0.0f ? -volume.background : volume.background;
    }
    if (brick.active.count() > 0) bricks.push_back(brick);
  }
  VolumeGrid result;
  result.descriptor = grid.descriptor;
  result.volume = makeVolume(std::move(bricks), volume.background);
  return result;
}

DenseBox densify(const SparseVolume& volume, const Box& box, std::uint64_t maxBytes) {
  const double bytes = box.volume() * sizeof(float);
  if (maxBytes > 0 && bytes > double(maxBytes))
    throw UsageError("the box as an array takes " + std::to_string(std::uint64_t(bytes / 1e6)) +
                     " MB, more than the bound of " + std::to_string(maxBytes / 1'000'000));
  DenseBox dense{box, std::vector<float>(std::size_t(box.volume()), volume.background)};
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    const Coord corner = volume.brickCorner(b);
    const auto values = volume.brickValues(b);
    visitVoxels(localPart(corner, box), [&](Coord local) {
      dense.values[dense.offset(corner + local)] = values[voxelOffset(local)];
    });
  }
  return dense;
}

SparseVolume sparsify(const DenseBox& dense, float background, float activeAbove) {
  SparseVolume volume;
  volume.background = background;
  volume.origin = brickOf(dense.box.min) * kBrickSide;
  const Coord first = brickOf(dense.box.min), last = brickOf(dense.box.max);
  for (int x = first.x; x <= last.x; ++x)
    for (int y = first.y; y <= last.y; ++y)
      for (int z = first.z; z <= last.z; ++z)
        appendBrick(dense, Coord{x, y, z} * kBrickSide, activeAbove, volume);
  return volume;
}

Box StackShape::box() const {
  return {{}, {kBrickSide - 1, int(rows) * kBrickSide - 1, int(length) * kBrickSide - 1}};
}

StackShape stackShape(std::size_t bricks) {
  constexpr std::size_t kMaxLength = 65536 / kBrickSide;
  const std::size_t rows = std::max<std::size_t>(1, (bricks + kMaxLength - 1) / kMaxLength);
  return {rows, (bricks + rows - 1) / rows};
}

SparseVolume stackBricks(const SparseVolume& volume) {
  SparseVolume stack = volume;
  stack.origin = {};
  const std::size_t length = stackShape(stack.brickCount()).length;
  for (std::size_t b = 0; b < stack.brickCount(); ++b)
    stack.bricks[b] = {0, int(b / length), int(b % length)};
  return stack;
}

SparseVolume unstackBricks(const SparseVolume& stack, std::span<const Coord> bricks, Coord origin) {
  SparseVolume volume = stack;
  volume.origin = origin;
  const std::size_t length = stackShape(bricks.size()).length;
  for (auto& brick : volume.bricks) brick = bricks[brick.y * length + brick.z];
  return volume;
}

std::vector<std::byte> encodeBricks(std::span<const Coord> bricks) {
  std::vector<std::byte> bytes;
  appendNumber(bricks.size(), bytes);
  Coord before{0, 0, -1};
  for (const Coord brick : bricks) {
    if (brick.x == before.x && brick.y == before.y) {
      appendNumber(std::uint64_t(brick.z - before.z), bytes);
    } else {
      appendNumber(kOtherColumn, bytes);
      for (const int place : {brick.x, brick.y, brick.z}) appendNumber(std::uint64_t(place), bytes);
    }
    before = brick;
  }
  return bytes;
}

std::vector<Coord> decodeBricks(std::span<const std::byte>& bytes) {
  const std::uint64_t count = takeNumber(bytes);
  if (count > bytes.size()) throw BadInput("the positions of bricks end too early");
  std::vector<Coord> bricks(count);
  Coord before{0, 0, -1};
  for (auto& brick : bricks) {
    const std::uint64_t gap = takeNumber(bytes);
    brick = before;
    if (gap != kOtherColumn)
      brick.z += int(gap);
    else
      for (int* place : {&brick.x, &brick.y, &brick.z}) *place = int(takeNumber(bytes));
    before = brick;
  }
  return bricks;
}

}  // namespace esvr::baselines
