#pragma once
/// Marches a ray through several grids at once (docs/math.md, "Several grids"). The march is
/// compiled for host and device; the functions that set up its scene are for the host.

#include <cstdint>
#include <vector>

#include "esvr/render.h"
#include "render/brick_march.h"

namespace esvr {

/// The light of several grids within one segment of a ray: adds up their extinctions and emissions.
class LightMixture {
 public:
  /// \param light  of a grid by itself
  ESVR_HD void add(const PixelColor& light, bool absorbs) {
    if (!(light.alpha > 0.0f)) return;
    const float own = depthOf(light.alpha), perAlpha = own / light.alpha;
    r_ += light.r * perAlpha, g_ += light.g * perAlpha, b_ += light.b * perAlpha;
    if (absorbs) depth_ += own;
  }
  /// The light of all grids, with the opacity of those that absorb.
  [[nodiscard]] ESVR_HD PixelColor total() const {
    const float alpha = -std::expm1(-depth_), share = depth_ > 0.0f ? alpha / depth_ : 1.0f;
    return {r_ * share, g_ * share, b_ * share, alpha};
  }

 private:
  /// The optical depth of an opacity. An opacity of 1 has the depth of the next smaller float.
  ESVR_HD static float depthOf(float alpha) {
    constexpr float kMost = 1.0f - 0x1p-24f;
    return -std::log1p(-(alpha < kMost ? alpha : kMost));
  }

  float r_ = 0.0f, g_ = 0.0f, b_ = 0.0f;  ///< emission: color times optical depth
  float depth_ = 0.0f;
};

/// One grid of a GridsScene.
struct GridInScene {
  BrickTableView table;
  TransferTableView transfer;
  float background;
  bool absorbs;
  /// What is added to a place of the scene to get the place relative to the table's origin.
  FloatPlace toTable;
};

struct GridsScene {
  /// Relative to an origin that all grids share; its box contains the cells of all. The table and
  /// the background of its rule are not used.
  MarchScene scene;
  GridInScene grids[kMostGrids];
};

/// A ray whose first samples have been added.
struct GridsProgress {
  float r = 0.0f, g = 0.0f, b = 0.0f, transmittance = 1.0f;
  int next = 0;                   ///< part of the first sample that has not been added (RayParts)
  bool divided = false;           ///< as RayParts::divided
  std::uint32_t inside = 0;       ///< bit g is set if the last sample of grid g is not empty space
  float last[kMostGrids] = {};    ///< value of that sample
  float change[kMostGrids] = {};  ///< as RayParts::change, where the bit of the grid is set
};

/// A GridsProgress that waits, as KeptRay.
struct KeptGridsRay {
  int next;  ///< below 0: the ray has ended
  bool divided;
  std::uint32_t inside;
  float last[kMostGrids], change[kMostGrids];

  [[nodiscard]] ESVR_HD static KeptGridsRay ended() { return {-1, false, 0, {}, {}}; }
  ESVR_HD static KeptGridsRay of(const GridsProgress& at) {
    KeptGridsRay kept{at.next, at.divided, at.inside, {}, {}};
    for (int g = 0; g < kMostGrids; ++g) kept.last[g] = at.last[g], kept.change[g] = at.change[g];
    return kept;
  }
  [[nodiscard]] ESVR_HD GridsProgress progress(const PixelColor& channels) const {
    GridsProgress at;
    at.r = channels.r, at.g = channels.g, at.b = channels.b, at.transmittance = channels.alpha;
    at.next = next, at.divided = divided, at.inside = inside;
    for (int g = 0; g < kMostGrids; ++g) at.last[g] = last[g], at.change[g] = change[g];
    return at;
  }
};
ESVR_HD inline PixelColor channelsOf(const GridsProgress& at) {
  return {at.r, at.g, at.b, at.transmittance};
}

/// The visitor of a march through grids whose bricks all have slots or are vacant.
struct AllGridsAreThere {
  ESVR_HD void entered(int, std::uint32_t) const {}
  ESVR_HD bool wantsMore(int, std::uint32_t, std::uint32_t) const { return false; }
};

namespace grids_march {

/// The brick of a grid that a ray is in.
struct Cursor {
  brick_march::Found found{kNoCells, {-1, -1, -1}, 1};
  const float* values = nullptr;
  bool isMissing = false;

  /// \return false if a brick is missing and the ray asks for no more
  template <class Slots, class Visitor>
  ESVR_HD bool moveTo(const Coord& cell, const BrickTableView& table, const Slots& slots, int grid,
                      Visitor& visitor) {
    using namespace brick_march;
    if (found.contains(cell)) return true;
    found = inside(table, cell) ? find(table, cell) : outside(cell);
    const std::uint32_t slot =
        found.brick == kNoCells ? BrickSlotsView::kVacant : slots.slot(found.brick);
    const bool there = slots.hasSlot(slot);
    values = there ? slots.values(slot) : nullptr;
    isMissing = !there && slot != BrickSlotsView::kVacant;
    if (there) visitor.entered(grid, slot);
    return !isMissing || visitor.wantsMore(grid, found.brick, slot);
  }

 private:
  /// The cube around a cell that lies outside a table. Blocks of the table begin at multiples of
  /// their side, so that none lies in it.
  ESVR_HD static brick_march::Found outside(const Coord& cell) {
    constexpr int kMask = ~(kBlockSide - 1);
    return {kNoCells, {cell.x & kMask, cell.y & kMask, cell.z & kMask}, kBlockSide};
  }
};

/// What the grids have at one place.
struct Sample {
  float value[kMostGrids] = {};
  std::uint32_t inside = 0;  ///< as GridsProgress::inside
  bool isMissing = false;
  int advance = 1 << 30;  ///< samples to the next place where any grid may differ from here

  ESVR_HD void mayAdvance(int samples) { advance = samples < advance ? samples : advance; }
};

/// Looks up one grid. \return false if the ray asks for no more bricks
template <class Slots, class Visitor>
ESVR_HD inline bool look(const GridInScene& grid, const Slots& slots, int number,
                         const MarchSamples& samples, const FloatPlace& scenePlace, Cursor& cursor,
                         Sample& sample, Visitor& visitor) {
  const FloatPlace place{scenePlace.x + grid.toTable.x, scenePlace.y + grid.toTable.y,
                         scenePlace.z + grid.toTable.z};
  const Coord cell = brick_march::cellOf(place);
  const bool goesOn = cursor.moveTo(cell, grid.table, slots, number, visitor);
  sample.isMissing = sample.isMissing || cursor.isMissing;
  if (cursor.values == nullptr) {
    sample.mayAdvance(samplesToLeave(place, samples.perVoxel, cursor.found.low, cursor.found.side));
    return goesOn;
  }
  sample.mayAdvance(1);
  sample.value[number] = brick_march::interpolate(cursor.values, place, cell);
  if (sample.value[number] != grid.background) sample.inside |= 1u << number;
  return goesOn;
}

/// The light of a grid in the segment before a sample, or at the sample (Classification).
/// \param before, value  of the samples at the segment's ends
/// \param length         of the segment in steps
ESVR_HD inline PixelColor lightOf(const GridInScene& grid, Classification classification,
                                  float before, float value, bool isInside, float length) {
  if (classification == Classification::kPreIntegrated)
    return grid.transfer.segments(before, value, length);
  if (!isInside) return {0.0f, 0.0f, 0.0f, 0.0f};
  const Classified c = grid.transfer(value);
  return {c.r * c.alpha, c.g * c.alpha, c.b * c.alpha, c.alpha};
}

/// The values of a grid at the ends of the segment before a sample.
struct Ends {
  bool was, is;  ///< whether they are not empty space
  float before, value;

  ESVR_HD Ends(const GridInScene& grid, int number, const Sample& sample, const GridsProgress& at)
      : was((at.inside >> number & 1u) != 0),
        is((sample.inside >> number & 1u) != 0),
        before(was ? at.last[number] : grid.background),
        value(is ? sample.value[number] : grid.background) {}
};

/// Whether the segment before a sample must be divided, as SampleRule::bends() for each grid.
template <int kGrids>
ESVR_HD inline bool bends(const GridsScene& s, const Sample& sample, const GridsProgress& at) {
  if (at.divided || s.scene.rule.classification != Classification::kPreIntegrated) return false;
  for (int g = 0; g < kGrids; ++g) {
    const Ends ends(s.grids[g], g, sample, at);
    if ((ends.was || ends.is) &&
        s.grids[g].transfer.segments.bends(ends.before, ends.value, ends.was ? at.change[g] : 0.0f,
                                           at.transmittance))
      return true;
  }
  return false;
}

/// Adds a sample to a ray, with the segment before it.
template <int kGrids>
ESVR_HD inline void add(const GridsScene& s, const Sample& sample, GridsProgress& at) {
  LightMixture mixture;
  const float partsInStep = at.divided ? float(kSegmentParts) : 1.0f, length = 1.0f / partsInStep;
  for (int g = 0; g < kGrids; ++g) {
    const Ends ends(s.grids[g], g, sample, at);
    if (ends.was || ends.is)
      mixture.add(lightOf(s.grids[g], s.scene.rule.classification, ends.before, ends.value, ends.is,
                          length),
                  s.grids[g].absorbs);
    at.last[g] = ends.value;
    at.change[g] = (ends.value - ends.before) * partsInStep;
  }
  at.inside = sample.inside;
  const PixelColor light = mixture.total();
  at.r += at.transmittance * light.r;
  at.g += at.transmittance * light.g;
  at.b += at.transmittance * light.b;
  at.transmittance *= 1.0f - light.alpha;
}

}  // namespace grids_march

/// Adds samples to a ray until it ends or meets a brick that is missing.
/// \tparam kGrids  number of grids
/// \param slots    for each grid: BrickSlotsView, or a type with the same functions
/// \param visitor  as for marchBricks(), with the number of the grid as first argument
/// \return true if the ray has ended
template <int kGrids, class Slots, class Visitor>
ESVR_HD inline bool marchGrids(const GridsScene& s, const Slots* slots, const MarchSamples& samples,
                               GridsProgress& at, Visitor& visitor) {
  using namespace grids_march;
  Cursor cursors[kGrids];
  bool looksAhead = false;
  RayParts parts{0.0f, at.divided};
  int part = at.next > 0 ? at.next : samples.start(parts);
  at.divided = parts.divided;
  while (part <= samples.lastPart && !(at.transmittance < s.scene.rule.minTransmittance)) {
    Sample sample;
    bool goesOn = true;
    for (int g = 0; g < kGrids; ++g)
      goesOn =
          look(s.grids[g], slots[g], g, samples, samples.at(part), cursors[g], sample, visitor) &&
          goesOn;
    if (!samples.inside(part)) sample.inside = 0;
    if (sample.isMissing && !looksAhead) at.next = part;
    looksAhead = looksAhead || sample.isMissing;
    if (!goesOn) return false;
    if (looksAhead) {
      part += kSegmentParts * sample.advance;
      continue;
    }
    if (bends<kGrids>(s, sample, at)) {
      part = parts.divide(part);
    } else {
      const bool skips = !at.divided && (sample.inside | at.inside) == 0;
      if ((sample.inside | at.inside) != 0) add<kGrids>(s, sample, at);
      part = skips ? part + kSegmentParts * sample.advance : parts.next(part);
    }
    at.divided = parts.divided;
  }
  return !looksAhead;
}

/// The color of a ray that has ended.
template <int kGrids>
[[nodiscard]] ESVR_HD inline PixelColor finished(const GridsScene& s, GridsProgress at) {
  if (at.inside != 0) grids_march::add<kGrids>(s, {}, at);
  return {at.r, at.g, at.b, 1.0f - at.transmittance};
}

// The scene of a picture.

/// \throws UsageError  as for renderField; the options have not as many looks as there are grids, or
///                     ask for something that several grids do not have (makeGridsRenderer)
void checkGridsOptions(const RenderOptions& options, std::size_t grids);

/// The look of a grid of a picture; that of the first one is RenderOptions::transfer.
[[nodiscard]] GridLook lookOf(const RenderOptions& options, std::size_t grid);

/// The cells of a grid.
struct GridTable {
  BrickTableView table;
  PlaceBox box;  ///< of the cells, relative to the table's origin; empty if there are none
  TransferTableView transfer;
  float background;
};

/// \param options  as checkGridsOptions() requires
/// \param grids    at least one of them has cells
[[nodiscard]] GridsScene gridsScene(const RenderOptions& options,
                                    const std::vector<GridTable>& grids);

/// The first sample of a bin in which a ray may meet a grid, counted from the eye.
/// \throws UsageError  a ray is too long
[[nodiscard]] double firstSampleOf(const GridsScene& scene);

/// The view for covers of the bricks of a grid, whose places are relative to its table's origin.
[[nodiscard]] CoverView coverViewOf(const GridsScene& scene, std::size_t grid,
                                    Resolution resolution);

}  // namespace esvr
