// Voxels that are NaN or infinite: their layer, its section, and their way back into a volume.

#include "format/non_finite_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "core/geometry.h"
#include "esvr/error.h"
#include "format/voxel_sections.h"

namespace esvr::format {
namespace {

// ---- The palette

/// The kinds of values as the numbers of the palette. Vacant voxels have kFinite.
enum Kind { kFinite, kNan, kPlusInfinity, kMinusInfinity, kKindCount };

Kind kindOf(float value) {
  if (std::isfinite(value)) return kFinite;
  if (std::isnan(value)) return kNan;
  return value > 0.0f ? kPlusInfinity : kMinusInfinity;
}

float valueOf(Kind kind) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  if (kind == kNan) return std::numeric_limits<float>::quiet_NaN();
  return kind == kPlusInfinity ? kInfinity : -kInfinity;
}

Kind kindAt(const VoxelLayer& layer, std::size_t brick, int v) {
  return Kind(layer.palette[std::size_t(layer.codes[brick * kBrickVoxels + std::size_t(v)])]);
}

Coord cornerOfKinds(const VoxelLayer& layer, std::size_t brick) {
  return layer.origin + layer.bricks[brick] * kBrickSide;
}

}  // namespace

// ---- The layer

namespace {

/// The voxels of each brick that are not finite.
struct Found {
  std::vector<BrickMask> masks;
  std::array<bool, kKindCount> kinds{true, false, false, false};
};

Found nonFiniteOf(const SparseVolume& volume) {
  Found found{std::vector<BrickMask>(volume.brickCount())};
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Kind kind = kindOf(volume.brickValues(b)[std::size_t(v)]);
      if (kind == kFinite || !volume.active[b].test(v)) continue;
      found.masks[b].set(v);
      found.kinds[kind] = true;
    }
  return found;
}

/// Adds a brick of the volume. \param codes  of the kinds
void addKindsOf(const SparseVolume& volume, std::size_t b, const BrickMask& mask,
                const std::array<std::int32_t, kKindCount>& codes, VoxelLayer& layer) {
  BrickMask vacant;
  for (std::size_t w = 0; w < mask.words.size(); ++w) vacant.words[w] = ~mask.words[w];
  layer.bricks.push_back(volume.bricks[b]);
  layer.active.push_back(mask);
  layer.vacant.push_back(vacant);
  for (int v = 0; v < kBrickVoxels; ++v)
    layer.codes.push_back(mask.test(v) ? codes[kindOf(volume.brickValues(b)[std::size_t(v)])]
                                       : codes[kFinite]);
}

/// Moves the origin to the smallest corner, so that the same voxels make the same layer whatever else a volume has.
void moveOrigin(VoxelLayer& layer) {
  Coord low = layer.bricks.front();
  for (const Coord brick : layer.bricks) low = minCoord(low, brick);
  for (Coord& brick : layer.bricks) brick = brick - low;
  layer.origin = layer.origin + low * kBrickSide;
}

}  // namespace

std::optional<VoxelLayer> nonFiniteLayer(const SparseVolume& volume) {
  const Found found = nonFiniteOf(volume);
  VoxelLayer layer;
  layer.form = VoxelForm::kPalette;
  layer.origin = volume.origin;
  std::array<std::int32_t, kKindCount> codes{};
  for (int kind = 0; kind < kKindCount; ++kind) {
    if (!found.kinds[std::size_t(kind)]) continue;
    codes[std::size_t(kind)] = std::int32_t(layer.palette.size());
    layer.palette.push_back(float(kind));
  }
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    if (found.masks[b].count() > 0) addKindsOf(volume, b, found.masks[b], codes, layer);
  if (layer.bricks.empty()) return std::nullopt;
  moveOrigin(layer);
  return layer;
}

NonFiniteCounts countsOf(const VoxelLayer& layer) {
  std::array<std::uint64_t, kKindCount> counts{};
  for (std::size_t b = 0; b < layer.bricks.size(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v)
      if (layer.active[b].test(v)) ++counts[std::size_t(kindAt(layer, b, v))];
  return {counts[kNan], counts[kPlusInfinity], counts[kMinusInfinity]};
}

// ---- The rules

namespace {

bool isPaletteOfKinds(const std::vector<float>& palette) {
  const auto isKind = [](float value) {
    return value == 0.0f || value == 1.0f || value == 2.0f || value == 3.0f;
  };
  return !palette.empty() && palette.front() == 0.0f && std::ranges::all_of(palette, isKind) &&
         std::ranges::adjacent_find(palette, std::ranges::greater_equal()) == palette.end();
}

/// What is wrong with a brick of the layer; null: nothing.
const char* brickFaultOf(const VoxelLayer& layer, std::size_t b, const Box& box) {
  const BrickMask &active = layer.active[b], &vacant = layer.vacant[b];
  if (active.count() == 0) return "a brick has no voxel that is not finite";
  for (int v = 0; v < kBrickVoxels; ++v) {
    if (active.test(v) == vacant.test(v)) return "a voxel is neither vacant nor not finite";
    if (active.test(v) != (kindAt(layer, b, v) != kFinite)) return "a voxel has the wrong kind";
    if (active.test(v) && !box.contains(cornerOfKinds(layer, b) + voxelLocal(v)))
      return "a voxel lies outside the bounding box";
  }
  return nullptr;
}

}  // namespace

std::optional<Fault> nonFiniteFaultOf(const StoredGrid& grid) {
  const auto fault = [](const char* text) { return Fault{SectionKind::kNonFinite, text}; };
  if (grid.nonFiniteVoxels.has_value() != (grid.nonFinite.total() > 0))
    return fault("its voxels that are not finite are not those that it counts");
  if (!grid.nonFiniteVoxels) return std::nullopt;
  const VoxelLayer& layer = *grid.nonFiniteVoxels;
  if (layer.form != VoxelForm::kPalette || layer.background != 0.0f ||
      !isPaletteOfKinds(layer.palette))
    return fault("its values are no kinds of voxels that are not finite");
  for (std::size_t b = 0; b < layer.bricks.size(); ++b)
    if (const char* text = brickFaultOf(layer, b, grid.activeBox)) return fault(text);
  if (!(countsOf(layer) == grid.nonFinite))
    return fault("it has another number of voxels that are not finite than its record says");
  return std::nullopt;
}

// ---- The section

std::vector<std::byte> putNonFinite(const StoredGrid& grid, const StoredGrid* before) {
  if (before && before->nonFiniteVoxels == grid.nonFiniteVoxels) return {};
  return putVoxels(*grid.nonFiniteVoxels);
}

void getNonFinite(SectionReader& sections, std::uint32_t g, const EsvrFile* previous,
                  StoredGrid& grid) {
  if (grid.nonFinite.total() == 0) return;
  const SectionId id{SectionKind::kNonFinite, g};
  const std::string where = sections.place(id);
  const auto content = sections.get(id);
  if (!content.empty()) {
    grid.nonFiniteVoxels = getVoxels(content, where, sections.budget());
  } else {
    if (!previous || g >= previous->grids.size() || !previous->grids[g].nonFiniteVoxels)
      throw BadInput(where + ": there is no frame before that has such voxels");
    const VoxelLayer& layer = *previous->grids[g].nonFiniteVoxels;
    const VoxelMemory memory = takeBricks(layer.bricks.size(), where, sections.budget());
    grid.nonFiniteVoxels = layer;
    grid.nonFiniteVoxels->codes =
        VoxelArray<std::int32_t>(layer.codes.begin(), layer.codes.end(), memory);
  }
  if (const auto fault = nonFiniteFaultOf(grid)) throw BadInput(where + ": " + fault->text);
}

// ---- The way back

namespace {

bool isChosen(const NonFinitePlace& place, Coord corner) {
  return !place.bricks || std::ranges::binary_search(*place.bricks, corner);
}

/// The corners of the layer's bricks that have such a voxel in the box, and that the volume lacks.
std::vector<Coord> lackingIn(const SparseVolume& volume, const VoxelLayer& layer,
                             const NonFinitePlace& place) {
  std::vector<Coord> lacking;
  for (std::size_t b = 0; b < layer.bricks.size(); ++b) {
    const Coord corner = cornerOfKinds(layer, b);
    if (!isChosen(place, corner)) continue;
    if (brickWith(volume, corner)) continue;
    for (int v = 0; v < kBrickVoxels; ++v)
      if (layer.active[b].test(v) && place.box.contains(corner + voxelLocal(v))) {
        lacking.push_back(corner);
        break;
      }
  }
  return lacking;
}

/// \throws RuntimeFailure  the bricks are 2^31 voxels apart
void requireNear(const Box& corners) {
  const auto isFar = [&](auto axis) {
    return std::int64_t(corners.max.*axis) - corners.min.*axis > Box::kMax - kBrickSide;
  };
  if (std::ranges::any_of(kAxes, isFar))
    throw RuntimeFailure("voxels that are not finite lie 2^31 voxels from others");
}

/// Adds bricks without active voxels. Inside the surface of a level set they have the negated background.
void addLacking(const std::vector<Coord>& lacking, bool isLevelSet, SparseVolume& volume) {
  if (lacking.empty()) return;
  std::optional<EmptySigns> signs;
  if (isLevelSet && volume.brickCount() > 0 && volume.background > 0.0f) signs.emplace(volume);
  std::vector<Coord> corners = brickCorners(volume);
  corners.insert(corners.end(), lacking.begin(), lacking.end());
  std::ranges::sort(corners);
  Box box;
  for (const Coord corner : corners) box.expand(corner);
  requireNear(box);
  SparseVolume wide = withBricks(volume, corners);
  for (std::size_t b = 0; b < corners.size(); ++b)
    if (const auto own = brickWith(volume, corners[b]))
      wide.active[b] = volume.active[*own];
    else if (signs && signs->isInside(brickOf(corners[b])))
      std::ranges::fill(wide.brickValues(b), -volume.background);
  volume = std::move(wide);
}

}  // namespace

void restoreNonFinite(const StoredGrid& grid, const NonFinitePlace& place, NonFiniteAs as,
                      SparseVolume& volume) {
  if (!grid.nonFiniteVoxels) return;
  const VoxelLayer& layer = *grid.nonFiniteVoxels;
  if (as == NonFiniteAs::kStored)
    addLacking(lackingIn(volume, layer, place), grid.descriptor.gridClass == GridClass::kLevelSet,
               volume);
  for (std::size_t l = 0; l < layer.bricks.size(); ++l) {
    const Coord corner = cornerOfKinds(layer, l);
    const auto b = brickWith(volume, corner);
    if (!b || !isChosen(place, corner)) continue;
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (!layer.active[l].test(v) || !place.box.contains(corner + voxelLocal(v))) continue;
      const bool isStored = as == NonFiniteAs::kStored;
      volume.brickValues(*b)[std::size_t(v)] =
          isStored ? valueOf(kindAt(layer, l, v)) : volume.background;
      isStored ? volume.active[*b].set(v) : volume.active[*b].reset(v);
    }
  }
  if (as == NonFiniteAs::kEmpty) dropInactiveBricks(volume);
}

}  // namespace esvr::format
