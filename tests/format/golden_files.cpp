#include "format/golden_files.h"

#include <algorithm>
#include <bit>

#include "esvr/grid_coding.h"
#include "format/crafted_file.h"
#include "format/sample_files.h"

namespace esvr::test {
namespace {

constexpr auto kKindOfNoVersion = format::SectionKind(0x7e57);

/// Every number is written here, and none is computed.
StoredGrid oneEllipsoid() {
  StoredGrid grid = emptyGrid();
  grid.descriptor.name = "density";
  Ellipsoids e;
  e.resize(1);
  e.center = {{{1.5f}, {-2.25f}, {1000.0f}}};
  e.logScale = {{{0.0f}, {-1.0f}, {2.5f}}};
  e.rotation = {{{0.8f}, {0.0f}, {-0.6f}, {0.0f}}};
  e.intensity = {0.75f};
  grid.field.chunks = {{{10, -20, 30}, e}};
  return grid;
}

/// A ramp of a few values in two bricks, with an inactive voxel that is not the background.
StoredGrid fewValues() {
  std::vector<BrickInput> bricks(2);
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    bricks[b].corner = {-8, 16, std::int32_t(b) * kBrickSide};
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord at = bricks[b].corner + voxelLocal(v);
      bricks[b].values[std::size_t(v)] = float((at.x + at.y * at.z / 4) & 15) * 0.125f;
      if (at.z > 2 || at == Coord{-5, 18, 1}) bricks[b].active.set(v);
    }
  }
  const SparseVolume volume = makeVolume(bricks, 0.125f);
  return makeStoredVoxels({}, volume, exactLayer(volume));
}

/// A palette of positive values as floats, whose order is that of their bits.
VoxelLayer asFloats(VoxelLayer layer) {
  layer.form = VoxelForm::kFloat;
  for (auto& code : layer.codes)
    code = std::bit_cast<std::int32_t>(layer.palette[std::size_t(code)]);
  layer.palette.clear();
  return layer;
}

/// 16 x 8 x 8 floats that are equal under a mirror along x but for one voxel, many of them 0.5.
StoredGrid mirroredValues() {
  std::vector<BrickInput> bricks(2);
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    bricks[b].corner = {std::int32_t(b) * kBrickSide, -8, 8};
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord at = bricks[b].corner + voxelLocal(v);
      const std::int32_t x = std::min(at.x, 15 - at.x);
      const std::int32_t n = (x * 64 + (at.y + 8) * 8 + at.z - 8) * 37 % 512;
      bricks[b].values[std::size_t(v)] =
          at.z % 3 == 0 || at == Coord{9, -6, 10} ? 0.5f : 1.0f + float(n) * float(n) / 65536.0f;
      if (x > 1 || n % 5 != 0) bricks[b].active.set(v);
    }
  }
  const SparseVolume volume = makeVolume(bricks, 0.0f);
  return makeStoredVoxels({}, volume, asFloats(exactLayer(volume)));
}

/// 32 x 8 x 16 floats that repeat along z after a brick and are equal under a mirror along x.
StoredGrid copiedValues() {
  std::vector<BrickInput> bricks(8);
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    bricks[b].corner = Coord{std::int32_t(b / 2), 2, std::int32_t(b % 2)} * kBrickSide;
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord at = bricks[b].corner + voxelLocal(v);
      const std::int32_t n = std::min(at.x, 31 - at.x) * 64 + (at.y & 7) * 8 + (at.z & 7);
      bricks[b].values[std::size_t(v)] = float(n * n % 11);
      if (n % 5 != 0) bricks[b].active.set(v);
    }
  }
  const SparseVolume volume = makeVolume(bricks, 0.0f);
  return makeStoredVoxels({}, volume, asFloats(exactLayer(volume)));
}

/// An ellipsoid with the mask of the few values.
StoredGrid masked() {
  StoredGrid grid = oneEllipsoid();
  const SparseVolume volume = volumeOf(*fewValues().voxels);
  grid.topology = TopologyKind::kMask;
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    grid.bricks.push_back(volume.brickCorner(b));
  grid.mask = volume.active;
  return grid;
}

/// An ellipsoid whose bricks, in two places, have thresholds for each block.
StoredGrid levelled() {
  StoredGrid grid = oneEllipsoid();
  grid.topology = TopologyKind::kBlocks;
  grid.activeThreshold = 0.125f;
  for (const std::int32_t x : {-8, 0, 64})
    for (std::int32_t z = 0; z < 40; z += 8) {
      grid.bricks.push_back({x, 16, z});
      BlockLevels& levels = grid.levels.emplace_back();
      for (std::size_t n = 0; n < kBlocksOfBrick; ++n)
        levels.of[n] = std::uint8_t(n == 3 ? z : x == 64 ? 47 - n : 20);
    }
  return grid;
}

/// Two grids with the same ellipsoids and the same mask.
EsvrFile twins() {
  EsvrFile file{{}, {masked(), masked()}};
  file.grids[1].descriptor.name = "color";
  return file;
}

/// A grid of numbers and one of vectors after it.
EsvrFile vectors() {
  EsvrFile file{{}, {fewValues(), oneEllipsoid(), oneEllipsoid(), oneEllipsoid()}};
  for (std::size_t c = 0; c < kComponents; ++c)
    file.grids[1 + c].descriptor.name = componentName("velocity", c);
  file.vectors = {{"velocity", 1}};
  return file;
}

/// An ellipsoid with a residual that corrects three voxels of a brick.
StoredGrid corrected() {
  StoredGrid grid = oneEllipsoid();
  VoxelLayer& residual = grid.residual.emplace();
  residual.form = VoxelForm::kQuantised;
  residual.divisor = 64.0;
  residual.origin = {8, -24, 1024};
  residual.bricks = {{}};
  residual.codes.resize(kBrickVoxels);
  residual.codes[0] = 3, residual.codes[77] = -2, residual.codes[511] = 1;
  residual.active.resize(1);
  residual.active[0].setAll();
  residual.vacant.resize(1);
  return grid;
}

/// Twice the few values plus a half, with the few values as reference, and other values without one.
EsvrFile related() {
  EsvrFile file{{}, {fewValues(), fewValues(), fewValues()}};
  for (float& value : file.grids[1].voxels->palette) value = 2.0f * value + 0.5f;
  file.grids[1].voxels->background = 0.75f;
  file.grids[1].reference = VoxelReference{0, 2.0f, 0.5f};
  file.grids[2].reference = VoxelReference{};
  return file;
}

/// A grid whose record has few bytes in common with that of another one, so that compressing both
/// together saves too little.
StoredGrid unlike(const std::string& name, std::int32_t n) {
  StoredGrid grid = oneEllipsoid();
  grid.descriptor.name = name;
  grid.descriptor.transform.mapType = "map of " + name;
  auto& rows = grid.descriptor.transform.affine.emplace();
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = 1.0 / (n + 2.0 * double(i));
  grid.descriptor.background = 1.0 / n;
  grid.activeBox = {{n * 65537, n * 91193, n * 77417}, {n * 165533, n * 191189, n * 177421}};
  grid.activeVoxels = std::uint64_t(n) * 0x123456789abcdef;
  grid.valueMin = -1.0f / float(n), grid.valueMax = 7.0f / float(n);
  grid.activeThreshold = 0.01f / float(n);
  grid.field.background = 3.0f / float(n);
  grid.field.kernel.kappa = 5.0f / float(n);
  return grid;
}

/// Two grids in the compact layout.
EsvrFile packed() {
  EsvrFile file{{}, {unlike("density", 3), unlike("temperature", 101)}};
  file.layout = FileLayout::kCompact;
  return file;
}

}  // namespace

std::vector<GoldenFile> goldenFiles() {
  return {
      {"no_grid", {}},
      {"one_ellipsoid", fileOf(oneEllipsoid())},
      {"two_grids", {everything(0).metadata, {fogGrid(3), levelSetGrid(2)}}},
      {"level_set", fileOf(levelSetGrid(2))},
      {"kappas_and_chunks", fileOf(chunkedGrid(4))},
      {"compressed", fileOf(fogGrid(60))},
      {"quantised", fileOf(quantisedGrid(20))},
      {"layered", fileOf(layeredGrid(20))},
      {"voxels", fileOf(fewValues())},
      {"mirrored_voxels", fileOf(mirroredValues())},
      {"copied_voxels", fileOf(copiedValues())},
      {"mask", fileOf(masked())},
      {"levels", fileOf(levelled())},
      {"twins", twins()},
      {"residual", fileOf(corrected())},
      {"carried",
       {{}, {oneEllipsoid()}, {carriedGrid(0, "vectors"), carriedGrid(2, "more vectors")}}},
      {"vector_grid", vectors()},
      {"related_voxels", related()},
      {"packed", packed()},
      {"unknown_section", fileOf(oneEllipsoid()), true},
  };
}

std::vector<std::byte> bytesOf(const GoldenFile& golden) {
  const auto bytes = encodeEsvr(golden.content);
  if (!golden.unknownSection) return bytes;
  CraftedFile file(bytes);
  file.add({kKindOfNoVersion, 0}, 0, bytesOf("of a later version"));
  return file.assemble();
}

}  // namespace esvr::test
