#include "esvr/forced_part.h"

#include <algorithm>
#include <cmath>

#include "esvr/grid_coding.h"

namespace esvr {
namespace {

bool anyChunk(const StoredGrid& grid, bool (*has)(const Ellipsoids&)) {
  return std::ranges::any_of(grid.field.chunks,
                             [&](const Chunk& chunk) { return has(chunk.ellipsoids); });
}

/// True if float32 storage stores rotations. Quantised ellipsoids always have a stream of them.
bool isTurned(const Ellipsoids& e) {
  const auto differs = [&](std::size_t i) {
    return e.rotation[0][i] != 1.0f || e.rotation[1][i] != 0.0f || e.rotation[2][i] != 0.0f ||
           e.rotation[3][i] != 0.0f;
  };
  for (std::size_t i = 0; i < e.size(); ++i)
    if (differs(i)) return true;
  return false;
}

bool hasKappas(const Ellipsoids& e) { return !e.kappa.empty(); }
bool hasNegative(const Ellipsoids& e) {
  return std::ranges::any_of(e.intensity, [](float value) { return value < 0.0f; });
}

bool hasSigns(const StoredGrid& grid) {
  if (grid.quantised.empty()) return anyChunk(grid, hasNegative);
  return std::ranges::any_of(grid.quantised, [](const QuantisedEllipsoids& q) {
    return q.size() > 0 && q.lattice.signedIntensity;
  });
}

/// The smallest number of ellipsoids that can be divided into two layers.
constexpr std::size_t kDivisible = 2;

PartState lacking(bool stored, bool possible, const char* why) {
  if (stored) return {true};
  return possible ? PartState{} : PartState{false, why};
}

PartState stateOfSigns(const StoredGrid& grid) {
  return lacking(hasSigns(grid), !grid.quantised.empty(), "a float32 always has its sign");
}

PartState stateOfKappas(const StoredGrid& grid) {
  return lacking(anyChunk(grid, hasKappas), grid.quantised.empty(),
                 "quantised ellipsoids have one kappa in the format");
}

PartState stateOfRotations(const StoredGrid& grid) {
  const bool turned = anyChunk(grid, isTurned);
  const bool coded = !grid.quantised.empty() && streamBytes(grid).rotations > 0;
  return lacking(grid.quantised.empty() ? turned : coded, grid.quantised.empty(),
                 "the shapes of quantised ellipsoids determine how many bits their rotations have");
}

PartState stateOfLayers(const StoredGrid& grid) {
  const bool single = grid.field.chunks.size() == 1;
  const bool divisible =
      single && grid.quantised.size() == 1 && grid.quantised[0].size() >= kDivisible;
  return lacking(layerCount(grid) > 1, divisible,
                 "only quantised ellipsoids have layers, and it takes two of them");
}

/// A quaternion and its negative are the same rotation, and only one of them is the identity that
/// the encoder leaves out.
void forceRotations(StoredGrid& grid) {
  for (Chunk& chunk : grid.field.chunks)
    for (float& w : chunk.ellipsoids.rotation[0]) w = -w;
}

void forceKappas(StoredGrid& grid) {
  for (Chunk& chunk : grid.field.chunks)
    chunk.ellipsoids.kappa.assign(chunk.ellipsoids.size(), grid.field.kernel.kappa);
}

void forceSigns(StoredGrid& grid) {
  for (QuantisedEllipsoids& q : grid.quantised) q.lattice.signedIntensity = true;
}

/// The threshold of level 0 with which the middle level has that of the grid.
float baseOf(const StoredGrid& grid) {
  return grid.activeThreshold / thresholdAt(1.0f, kMiddleLevel);
}

/// A residual that is 0 in every brick.
void forceResidual(StoredGrid& grid, const SparseVolume& decoded) {
  VoxelLayer& layer = grid.residual.emplace();
  layer.form = VoxelForm::kQuantised;
  layer.origin = decoded.origin;
  layer.bricks = decoded.bricks;
  layer.codes.assign(decoded.brickCount() * kBrickVoxels, 0);
  BrickMask all;
  all.setAll();
  layer.active.assign(decoded.brickCount(), all);
  layer.vacant.resize(decoded.brickCount());
}

PartState stateOfLevels(const StoredGrid& grid) {
  if (grid.topology == TopologyKind::kBlocks) return {true};
  if (grid.topology == TopologyKind::kMask) return {false, "a mask says which voxels are active"};
  if (grid.topology == TopologyKind::kBricks) return {false, "a narrow band has one threshold"};
  if (!std::isnormal(baseOf(grid)))
    return {false, "levels need a threshold above 0 that can be divided"};
  return {};
}

/// All blocks have the level of the grid's own threshold, whose base is a power of two below it.
void forceLevels(StoredGrid& grid, const SparseVolume& decoded) {
  grid.activeThreshold = baseOf(grid);
  grid.topology = TopologyKind::kBlocks;
  BlockLevels same;
  same.of.fill(kMiddleLevel);
  grid.levels.assign(decoded.brickCount(), same);
  for (std::size_t b = 0; b < decoded.brickCount(); ++b)
    grid.bricks.push_back(decoded.brickCorner(b));
}

/// Layers are usually sorted by weight. These halves are not, so that the order of the sum, and with
/// it every bit of the voxels, is kept.
void forceLayers(StoredGrid& grid) {
  QuantisedEllipsoids& q = grid.quantised.front();
  q.layerEnds = {q.size() / 2, q.size()};
}

/// The second chunk is empty, so that the sum keeps its order.
void forceChunks(StoredGrid& grid) {
  grid.field.chunks.push_back({grid.field.chunks.front().origin, {}});
  if (!grid.quantised.empty()) grid.quantised.emplace_back();
}

}  // namespace

const std::vector<NamedPart>& allParts() {
  static const std::vector<NamedPart> parts{
      {Part::kRotations, "rotations"}, {Part::kSigns, "signs"},
      {Part::kKappas, "kappa"},        {Part::kResidual, "residual"},
      {Part::kMask, "mask"},           {Part::kLevels, "thresholds of blocks"},
      {Part::kLayers, "layers"},       {Part::kChunks, "chunk table"}};
  return parts;
}

PartState stateOf(const StoredGrid& grid, Part part) {
  if (part == Part::kMask && grid.voxels) return {true, "the codes of voxels have the active mask"};
  if (grid.field.ellipsoidCount() == 0) return {false, "there are no ellipsoids"};
  switch (part) {
    case Part::kRotations:
      return stateOfRotations(grid);
    case Part::kSigns:
      return stateOfSigns(grid);
    case Part::kKappas:
      return stateOfKappas(grid);
    case Part::kResidual:
      return {grid.residual.has_value()};
    case Part::kMask:
      return {grid.topology == TopologyKind::kMask};
    case Part::kLevels:
      return stateOfLevels(grid);
    case Part::kLayers:
      return stateOfLayers(grid);
    case Part::kChunks:
      return {grid.field.chunks.size() > 1};
  }
  return {};
}

StoredGrid forcedPart(const StoredGrid& grid, Part part, const SparseVolume& decoded) {
  StoredGrid made = grid;
  switch (part) {
    case Part::kRotations:
      forceRotations(made);
      break;
    case Part::kSigns:
      forceSigns(made);
      break;
    case Part::kKappas:
      forceKappas(made);
      break;
    case Part::kResidual:
      forceResidual(made, decoded);
      break;
    case Part::kMask:
      storeMask(decoded, decoded.active, made);
      break;
    case Part::kLevels:
      forceLevels(made, decoded);
      break;
    case Part::kLayers:
      forceLayers(made);
      break;
    case Part::kChunks:
      forceChunks(made);
      break;
  }
  return made;
}

std::optional<PartBytes> bytesWithPart(const StoredGrid& grid, Part part,
                                       const SparseVolume& decoded) {
  const PartState state = stateOf(grid, part);
  if (state.stored || !state.why.empty()) return std::nullopt;
  return PartBytes{bytesAdded(forcedPart(grid, part, decoded)), bytesAdded(grid)};
}

}  // namespace esvr
