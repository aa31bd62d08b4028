// Single grids of a file: what decides that two are equal, how each is read and converted in a step, and several at the
// same time.

#include <tbb/global_control.h>
#include <xxhash.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <string>
#include <utility>
#include <variant>

#include "core/add_seconds.h"
#include "encode/grids_of_file.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "format/bytes.h"

namespace esvr {

// ---- Equal inputs

namespace {

template <class Items>
void putHash(format::ByteWriter& out, const Items& items) {
  const XXH128_hash_t hash = XXH3_128bits(items.data(), items.size() * sizeof(items.front()));
  for (const std::uint64_t word : {std::uint64_t(items.size()), hash.low64, hash.high64})
    out.put(word);
}

void putVolume(format::ByteWriter& out, const SparseVolume& volume) {
  for (const auto v : {volume.origin.x, volume.origin.y, volume.origin.z}) out.put(v);
  out.put(volume.background);
  putHash(out, volume.bricks);
  putHash(out, volume.values);
  putHash(out, volume.active);
}

/// A hash of the active voxels of a volume, whatever their values.
InputKey activeKeyOf(const SparseVolume& volume) {
  std::vector<Coord> corners;
  std::vector<BrickMask> masks;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    if (volume.active[b].count() == 0) continue;
    corners.push_back(volume.brickCorner(b));
    masks.push_back(volume.active[b]);
  }
  format::ByteWriter out;
  putHash(out, corners);
  putHash(out, masks);
  const XXH128_hash_t hash = XXH3_128bits(out.bytes().data(), out.size());
  return {hash.low64, hash.high64};
}

}  // namespace

InputKey keyOf(const ConvertInput& input) {
  format::ByteWriter out;
  // The class decides whether a grid is a narrow band. A lossless goal refuses doubles.
  out.put(std::uint8_t(input.descriptor.gridClass == GridClass::kLevelSet));
  out.put(std::uint8_t(input.descriptor.valueType == ValueType::kDouble));
  putVolume(out, input.source);
  const XXH128_hash_t hash = XXH3_128bits(out.bytes().data(), out.size());
  return {hash.low64, hash.high64};
}

// ---- One grid, and several at the same time

namespace encode {

bool isSmall(const GridSource& grid) {
  constexpr std::uint64_t kMostActive = std::uint64_t{1} << 20;
  return grid.activeVoxels <= kMostActive;
}

void forEachAtOnce(std::size_t count, std::size_t threads,
                   const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next{0};
  const CancelToken* const token = CancelScope::token();
  const auto work = [&] {
    const CancelScope scope(token);
    try {
      for (std::size_t i; !CancelScope::cancelled() && (i = next++) < count;) body(i);
    } catch (...) {
      next = count;
      throw;
    }
  };
  std::vector<std::future<void>> others;
  for (std::size_t t = 1; t < std::min(threads, count); ++t)
    others.push_back(std::async(std::launch::async, work));
  auto own = std::async(std::launch::deferred, work);
  own.wait();
  for (auto& other : others) other.wait();
  own.get();
  for (auto& other : others) other.get();
}

bool GridConverter::isCancelled() const {
  const CancelToken* const token = CancelScope::orToken(fit_.cancel);
  return token && token->cancelled();
}

void GridConverter::step(std::size_t g, bool isAlone,
                         const std::function<void(const FitOptions&)>& run) {
  FitOptions own = fit_;
  FitOptions& fit = isAlone ? fit_ : own;
  fit.progress = options_.convert.fit.progress;  // the one of an earlier step may be gone
  const std::function<void()> withOptions = [&] { run(fit); };
  if (options_.onStep)
    options_.onStep({g, isAlone, fit, withOptions});
  else
    withOptions();
}

void GridConverter::findScales() {
  for (std::size_t g = 0; g < grids_.size(); ++g)
    if (grids_[g].component == std::size_t{0})
      step(g, true, [&](const FitOptions&) { findScale(g); });
}

void GridConverter::findScale(std::size_t g) {
  VectorVolume vectors;
  Transform transform;
  if (grids_[g].readVector) {
    VectorGrid grid = grids_[g].readVector();
    transform = std::move(grid.descriptor.transform);
    vectors = std::move(grid.components);
  } else {
    for (std::size_t c = 0; c < kComponents; ++c) {
      VolumeGrid grid = grids_.at(g + c).read();
      transform = std::move(grid.descriptor.transform);
      vectors[c] = std::move(grid.volume);
    }
  }
  sets_.push_back({activeKeyOf(vectors.front()), std::move(transform)});
  const VectorScale scale{peakOfVectors(vectors), valueRangeOfVectors(vectors)};
  for (std::size_t c = 0; c < kComponents; ++c) scales_.at(g + c) = scale;
}

SourceKey GridConverter::keyOf(std::size_t g, const VolumeGrid& source) const {
  return {esvr::keyOf({source.descriptor, source.volume}), scales_[g].peak, scales_[g].range,
          grids_[g].goal, source.narrowing.largest()};
}

namespace {

/// Subtracts from a bound what is lost because doubles become floats. Their range, to which a bound in % refers, may be
/// lost, too.
void allowForNarrowing(const VolumeGrid& source, Goal& goal) {
  const Narrowing& narrowing = source.narrowing;
  if (narrowing.errors.count() == 0) return;
  const auto less = [&](double bound, double lost, const char* unit = "") {
    if (lost < bound) return bound - lost;
    const auto [by, most] = textsApart(lost, bound, "%.*g", 6);
    throw CannotConvert("grid '" + shownName(source.descriptor.name) +
                        "': floats differ from its doubles by up to " + by + unit +
                        ", and the bound is " + most);
  };
  if (auto* within = std::get_if<BoundGoal>(&goal)) {
    const double range = narrowing.max - narrowing.min;
    if (!within->relative || range > 0.0)
      *within = {
          less(within->relative ? within->bound * range : within->bound, narrowing.largest())};
  } else if (auto* share = std::get_if<RelativeBoundGoal>(&goal)) {
    share->share = less(share->share, narrowing.relativeAbove(share->floor), " times their values");
  }
}

}  // namespace

const Goal& GridConverter::goalOf(std::size_t g) const {
  if (goal_) return *goal_;
  return grids_[g].goal ? *grids_[g].goal : options_.convert.goal;
}

/// The goal of a grid. A bound in % of the range of vectors is the same for all components.
Goal GridConverter::resolvedGoal(std::size_t g, const VolumeGrid& source) const {
  Goal goal = goalOf(g);
  const auto& range = scales_[g].range;
  if (auto* within = std::get_if<BoundGoal>(&goal); within && within->relative && range)
    *within = {within->bound * *range, false};
  allowForNarrowing(source, goal);
  return goal;
}

const StoredGrid* GridConverter::previousOf(std::size_t g) const {
  if (!options_.previous.file) return nullptr;
  const std::string name = grids_[g].storedName();
  std::size_t before = 0;
  for (std::size_t other = 0; other < g; ++other) before += grids_[other].storedName() == name;
  for (const StoredGrid& grid : options_.previous.file->grids)
    if (grid.descriptor.name == name && before-- == 0) return &grid;
  return nullptr;
}

/// True for the components of vectors, and for grids with the active voxels of vectors. A vector is active where any
/// component is, so that by their values a component would add voxels to it or lose some. The exact set is stored
/// once for all of these grids, or follows from that of the grid that their voxels refer to.
bool GridConverter::needsExactSet(std::size_t g, const VolumeGrid& source) const {
  if (grids_[g].component) return true;
  return !sets_.empty() &&
         std::ranges::find(sets_, ActiveSet{activeKeyOf(source.volume),
                                            source.descriptor.transform}) != sets_.end();
}

/// What is known of a grid of the previous frame; null if nothing is.
const GridBefore* GridConverter::recordOf(const StoredGrid* previous) const {
  if (!previous) return nullptr;
  const std::span<const GridBefore> grids = options_.previous.grids;
  const auto at = std::size_t(previous - options_.previous.file->grids.data());
  return at < grids.size() ? &grids[at] : nullptr;
}

/// True if the same grid of the previous frame was made from the same source.
bool GridConverter::isAsBefore(const StoredGrid* previous, const VolumeGrid& source,
                               const SourceKey& key) const {
  const GridBefore* before = recordOf(previous);
  return before && before->key == key &&
         previous->descriptor.valueType == source.descriptor.valueType;
}

GridConversion GridConverter::make(std::size_t g, bool isAlone) {
  GridConversion made;
  step(g, isAlone, [&](const FitOptions& fit) {
    double secondsRead = 0.0, secondsConvert = 0.0;
    const VolumeGrid source = addSeconds(secondsRead, [&] { return read(g); });
    made = addSeconds(secondsConvert, [&] { return convert(g, source, nullptr, fit); });
    made.secondsRead = secondsRead, made.secondsConvert = secondsConvert;
    tell(source, made);
  });
  return made;
}

void GridConverter::tell(const VolumeGrid& source, const GridConversion& made) const {
  if (options_.onConverted && !isTrial_) options_.onConverted(source, made);
}

void GridConverter::tellAll(const std::vector<GridConversion>& grids) {
  isTrial_ = false;
  if (!options_.onConverted) return;
  const Completion completion;
  const bool areSmall = std::ranges::all_of(
      grids, [&](const GridConversion& grid) { return isSmall(grids_[grid.source]); });
  forEachAtOnce(grids.size(), areSmall ? mostAtOnce() : 1, [&](std::size_t i) {
    if (grids[i].twinOf) return;
    step(grids[i].source, false, [&](const FitOptions&) { tell(read(grids[i].source), grids[i]); });
  });
}

std::size_t GridConverter::mostAtOnce() const {
  // A GPU then has as many grids at a time as it has frames of a sequence.
  constexpr std::size_t kAtOnce = 4;
  using Limit = tbb::global_control;
  const std::size_t threads = Limit::active_value(Limit::max_allowed_parallelism);
  return options_.severalAtOnce ? std::min(kAtOnce, threads) : 1;
}

GridConversion GridConverter::convert(std::size_t g, const VolumeGrid& source,
                                      const StoredGrid* expected, const FitOptions& fit) const {
  GridConversion made{.source = g, .convertedAs = g, .key = keyOf(g, source)};
  made.bricks = source.volume.brickCount();
  made.nonFiniteReplaced = source.nonFiniteReplaced;
  made.inactive = source.inactive;
  const StoredGrid* const previous = previousOf(g);
  const GridBefore* const before = expected ? nullptr : recordOf(previous);
  if (!expected && isAsBefore(previous, source, made.key)) {
    made.asBefore = true;
    made.conversion.grid = *previous;
    made.conversion.compact = before->compact;
    made.conversion.grid.descriptor = source.descriptor;
    made.conversion.grid.reference.reset();  // it may name another grid of this file
    return made;
  }
  ConvertOptions options = options_.convert;
  options.fit = fit;
  options.goal = resolvedGoal(g, source);
  if (!asVoxels_.empty() && asVoxels_[g]) options.representation = Representation::kVoxels;
  options.previous = expected ? expected : previous;
  if (before) options.previousCompact = before->compact;
  if (expected) options.keepsPastErrors = false;  // those of another grid are not worth it
  if (scales_[g].peak) options.fit.peak = scales_[g].peak;
  if (grids_[g].component) options.measure = Measure::kValues;
  if (needsExactSet(g, source)) options.storage.activity = Activity::kExact;
  const ConvertInput input{source.descriptor, source.volume};
  if (!options_.paper) {
    made.conversion = convertVolume(input, options);
    return made;
  }
  PaperConversion byPaper = convertByPaper(input, {options.fit, *options_.paper}, options.storage);
  made.conversion = std::move(byPaper.conversion);
  made.paper = std::move(byPaper.record);
  return made;
}

}  // namespace encode

}  // namespace esvr
