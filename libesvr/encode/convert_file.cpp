// Converts the grids of a file together: vectors get one scale, grids of equal voxels are converted once, a
// size is divided, small grids are converted at the same time, and vectors that are smaller unchanged are
// carried. share_grids.cpp then lets voxels refer to those of another grid.
#include "esvr/convert_file.h"

#include <tbb/global_control.h>
#include <xxhash.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <variant>

#include "core/add_seconds.h"
#include "core/counted.h"
#include "encode/grids_of_file.h"
#include "encode/job.h"
#include "esvr/container.h"
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
  const auto& [file, grids] = options_.previous;
  const auto at = std::size_t(previous - file->grids.data());
  return at < grids.size() ? &grids[at] : nullptr;
}

/// True if the same grid of the previous frame was made from the same source.
bool GridConverter::isAsBefore(const StoredGrid* previous, const VolumeGrid& source,
                               const SourceKey& key) const {
  const GridBefore* before = recordOf(previous);
  return before && before->key == key &&
         previous->descriptor.valueType == source.descriptor.valueType;
}

GridConversion GridConverter::make(std::size_t g, const Wish& wish, bool isAlone) {
  GridConversion made;
  step(g, isAlone, [&](const FitOptions& fit) {
    double secondsRead = 0.0, secondsConvert = 0.0;
    const VolumeGrid source = addSeconds(secondsRead, [&] { return read(g); });
    made = addSeconds(secondsConvert, [&] { return convert(g, source, wish, fit); });
    made.secondsRead = secondsRead, made.secondsConvert = secondsConvert;
    if (options_.onConverted) options_.onConverted(source, made);
  });
  return made;
}

std::size_t GridConverter::mostAtOnce() const {
  // A GPU then has as many grids at a time as it has frames of a sequence.
  constexpr std::size_t kAtOnce = 4;
  using Limit = tbb::global_control;
  const std::size_t threads = Limit::active_value(Limit::max_allowed_parallelism);
  return options_.severalAtOnce ? std::min(kAtOnce, threads) : 1;
}

GridConversion GridConverter::convert(std::size_t g, const VolumeGrid& source, const Wish& wish,
                                      const FitOptions& fit) const {
  GridConversion made{.source = g, .convertedAs = g, .key = keyOf(g, source)};
  made.bricks = source.volume.brickCount();
  made.nonFiniteReplaced = source.nonFiniteReplaced;
  made.inactive = source.inactive;
  const StoredGrid* const previous = previousOf(g);
  const GridBefore* const before = wish.expected ? nullptr : recordOf(previous);
  if (!wish.expected && isAsBefore(previous, source, made.key)) {
    made.asBefore = true;
    made.conversion.grid = *previous;
    made.conversion.compact = before->compact;
    made.conversion.grid.descriptor = source.descriptor;
    made.conversion.grid.reference.reset();  // it may name another grid of this file
    return made;
  }
  ConvertOptions options = options_.convert;
  options.fit = fit;
  options.goal = wish.bytes ? Goal(SizeGoal{*wish.bytes}) : resolvedGoal(g, source);
  options.previous = wish.expected ? wish.expected : previous;
  if (before) options.previousCompact = before->compact;
  if (wish.expected) options.keepsPastErrors = false;  // those of another grid are not worth it
  if (scales_[g].peak) options.fit.peak = scales_[g].peak;
  if (grids_[g].component) options.measure = Measure::kValues;
  // With a size, every grid uses its own bytes for its values.
  if (!wish.bytes && needsExactSet(g, source)) options.storage.activity = Activity::kExact;
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

namespace {

using encode::GridConverter;
using encode::SizeTooSmall;

/// True for a grid whose conversion keeps few threads busy: its voxels are coded in one or two blocks, each on one thread.
bool isSmall(const GridSource& grid) {
  constexpr std::uint64_t kMostActive = std::uint64_t{1} << 20;
  return grid.activeVoxels <= kMostActive;
}

// Grids of equal voxels.

/// A grid whose conversion is that of an earlier grid, with a descriptor of its own.
struct Twin {
  std::size_t of = 0;  ///< the first grid with these voxels
  GridDescriptor descriptor;
  std::uint64_t nonFiniteReplaced = 0;
  InactiveValues inactive{};
  SourceKey key{};
  double secondsRead = 0.0;
};

using Twins = std::map<std::size_t, Twin>;

bool mayHaveTwin(const std::vector<GridSource>& grids, const GridSource& grid) {
  return std::ranges::count_if(grids, [&](const GridSource& other) {
           return grid.activeVoxels == other.activeVoxels && grid.activeBox == other.activeBox;
         }) > 1;
}

/// Finds the grids that have the voxels of a grid before them, and the same scale and goal. A key takes few
/// bytes, so that no volume has to be kept for a comparison.
Twins findTwins(const std::vector<GridSource>& grids, GridConverter& converter) {
  std::vector<std::size_t> candidates;
  for (std::size_t g = 0; g < grids.size(); ++g)
    if (mayHaveTwin(grids, grids[g])) candidates.push_back(g);
  std::vector<std::optional<Twin>> read(grids.size());
  const auto readOne = [&](std::size_t g) {
    VolumeGrid grid;
    const double seconds = secondsOf(
        [&] { converter.step(g, false, [&](const FitOptions&) { grid = converter.read(g); }); });
    read[g] = {g,
               std::move(grid.descriptor),
               grid.nonFiniteReplaced,
               grid.inactive,
               converter.keyOf(g, grid),
               seconds};
  };
  const bool areSmall =
      std::ranges::all_of(candidates, [&](std::size_t g) { return isSmall(grids[g]); });
  encode::forEachAtOnce(candidates.size(), areSmall ? converter.mostAtOnce() : 1,
                        [&](std::size_t i) { readOne(candidates[i]); });
  std::map<SourceKey, std::size_t> firstBy;
  Twins twins;
  for (const std::size_t g : candidates) {
    if (!read[g]) continue;  // it was cancelled
    const auto [first, isNew] = firstBy.emplace(read[g]->key, g);
    if (isNew) continue;
    read[g]->of = first->second;
    twins[g] = std::move(*read[g]);
  }
  return twins;
}

GridConversion twinOf(const GridConversion& grid, std::size_t source, const Twin& twin) {
  GridConversion made = grid;
  made.source = source;
  made.twinOf = grid.source;
  made.conversion.grid.descriptor = twin.descriptor;
  made.nonFiniteReplaced = twin.nonFiniteReplaced;
  made.inactive = twin.inactive;
  made.key = twin.key;
  made.secondsRead = twin.secondsRead, made.secondsConvert = 0.0;
  return made;
}

// The division of a size.

StoredGrid withDescriptor(StoredGrid grid, const GridDescriptor& descriptor) {
  grid.descriptor = descriptor;
  return grid;
}

/// The bytes that a twin usually adds: its record, and rows for the ellipsoids of one chunk, for
/// the bricks or the mask, and for the errors of layers. Voxels have fewer rows.
std::uint64_t usualBytes(const GridDescriptor& twin) {
  constexpr std::uint64_t kRows = 3;
  StoredGrid grid;
  grid.field.chunks.resize(1);
  return bytesAdded(withDescriptor(std::move(grid), twin)) + kRows * kSectionRowBytes;
}

/// The bytes of what a file holds besides its converted grids.
/// \throws UsageError  they leave nothing of `size`
std::uint64_t bytesBesideConverted(const FileSource& source, std::uint64_t size) {
  std::vector<StoredVector> vectors;
  for (std::size_t g = 0; g < source.grids.size(); ++g)
    if (source.grids[g].component == std::size_t{0}) vectors.push_back({source.grids[g].name, g});
  const std::uint64_t ofCarried = bytesOfCarried(source.carried);
  const std::uint64_t bytes =
      bytesBesideGrids(source.metadata) + ofCarried + bytesOfVectors(vectors);
  if (bytes < size) return bytes;
  std::string text = "the file takes " + std::to_string(bytes) + " bytes without any fitted grid";
  if (ofCarried > 0)
    text += " (grids that are carried unchanged take " + std::to_string(ofCarried) +
            " of them; to skip some makes room)";
  throw UsageError(text + "; the size allows " + std::to_string(size));
}

std::uint64_t less(std::uint64_t bytes, std::uint64_t by) { return bytes - std::min(bytes, by); }

/// The bytes that grids were found to need, by their indices.
using LeastBytes = std::map<std::size_t, std::uint64_t>;

/// Divides the wanted size of a file among its grids. Every grid gets a few bytes, or those that it was found to
/// need, and grids share the others by their active voxels. Bytes that a grid does not use go to those that
/// are converted after it. Twins of a grid have no share; the bytes of their records are reserved.
///
/// A grid is converted to bytes that it takes on its own. In a compact file it takes a few hundred fewer, which are
/// known of the grids that are made, and which the next ones get in addition.
class ByteShares {
 public:
  /// \param isCompact  the file will have FileLayout::kCompact
  ByteShares(const FileSource& source, std::optional<std::uint64_t> size, const Twins& twins,
             const LeastBytes& needed, bool isCompact)
      : left_(size), shares_(source.grids.size()), isCompact_(isCompact) {
    records_.layout = FileLayout::kCompact;
    // A file without grids has nothing to divide, and no option makes it smaller.
    if (source.grids.empty() && source.carried.empty()) left_.reset();
    if (!left_) return;
    *left_ -= bytesBesideConverted(source, *left_);
    for (std::size_t g = 0; g < shares_.size(); ++g) {
      if (const auto twin = twins.find(g); twin != twins.end()) {
        reserve(twin->second);
        continue;
      }
      weightLeft_ += shares_[g].weight = double(source.grids[g].activeVoxels) + 1.0;
    }
    setLeast(needed);
  }

  /// True if grids need more bytes than there are, and get them.
  [[nodiscard]] bool isOverdrawn() const { return isOverdrawn_; }

  /// Bytes for a grid without its twins; nothing if no size is wanted.
  [[nodiscard]] std::optional<std::uint64_t> of(std::size_t grid) const {
    if (!left_) return std::nullopt;
    const Share& share = shares_[grid];
    const double divided = double(less(*left_, leastLeft_));
    return share.least + std::uint64_t(divided * share.weight / weightLeft_);
  }

  /// Bytes that a grid saves in a compact file, as far as is known: the fewest of those that were made.
  [[nodiscard]] std::uint64_t saved() const { return saved_.value_or(0); }

  /// Subtracts the bytes of a converted grid and of its twins.
  /// \param previous  the same grid of the previous frame, from which it is predicted; null: none
  /// \return the bytes by which they exceed their share; if there are any, nothing is subtracted
  [[nodiscard]] std::uint64_t take(std::size_t grid, const StoredGrid& stored,
                                   const StoredGrid* previous) {
    if (!left_) return 0;
    const Share& share = shares_[grid];
    const std::uint64_t allowed = *of(grid) + share.reserved;
    const std::uint64_t bytes =
        isCompact_ ? bytesInCompact(share, stored) : bytesOf(share, stored, previous);
    if (bytes > allowed) return bytes - allowed;
    if (isCompact_) {
      records_.grids.push_back(encode::recordAlone(stored));
      const std::uint64_t saved = less(bytesAdded(stored), bytes);
      if (share.twins.empty()) saved_ = std::min(saved_.value_or(saved), saved);
    }
    left_ = less(*left_ + share.reserved, bytes);
    weightLeft_ -= share.weight;
    leastLeft_ -= share.least;
    return 0;
  }

 private:
  /// A grid that is not a twin.
  struct Share {
    double weight = 0.0;
    std::uint64_t least = 0;
    std::vector<GridDescriptor> twins;
    std::uint64_t reserved = 0;  ///< expected bytes of the twins
  };

  void reserve(const Twin& twin) {
    Share& share = shares_[twin.of];
    constexpr std::uint64_t kSmallerInCompact = 4;
    const std::uint64_t bytes = usualBytes(twin.descriptor) / (isCompact_ ? kSmallerInCompact : 1);
    share.twins.push_back(twin.descriptor);
    share.reserved += bytes;
    left_ = less(*left_, bytes);
  }

  /// Gives grids the bytes that they need, and the others the same few bytes.
  void setLeast(const LeastBytes& needed) {
    for (const auto& [g, bytes] : needed) leastLeft_ += shares_[g].least = bytes;
    // A file of small grids takes fewer bytes than its grids, each for itself, so that it may still fit.
    isOverdrawn_ = leastLeft_ > *left_;
    left_ = std::max(*left_, leastLeft_);
    const auto isOther = [&](std::size_t g) {
      return shares_[g].weight > 0.0 && !needed.contains(g);
    };
    std::uint64_t others = 0;
    for (std::size_t g = 0; g < shares_.size(); ++g) others += isOther(g);
    if (others == 0) return;
    // The record of a grid, its rows in the table, and the codes of a few values. Shares by active
    // voxels alone would be too small for a grid of a few voxels beside a large one.
    constexpr std::uint64_t kLeastOfGrid = 512;
    const std::uint64_t least = std::min(kLeastOfGrid, less(*left_, leastLeft_) / others);
    for (std::size_t g = 0; g < shares_.size(); ++g)
      if (isOther(g)) leastLeft_ += shares_[g].least = least;
  }

  /// Bytes that a grid with its twins adds to a compact file with the records of those that were taken, which take few
  /// bytes together. It depends on them by their padding only.
  [[nodiscard]] std::uint64_t bytesInCompact(const Share& share, const StoredGrid& stored) const {
    constexpr std::uint64_t kPadding = 8;
    EsvrFile file = records_;
    file.grids.push_back(stored);
    for (const auto& descriptor : share.twins)
      file.grids.push_back(withDescriptor(stored, descriptor));
    return encodeEsvr(file).size() + kPadding - encodeEsvr(records_).size();
  }

  [[nodiscard]] static std::uint64_t bytesOf(const Share& share, const StoredGrid& stored,
                                             const StoredGrid* previous) {
    const std::uint64_t bytes = bytesInFrame(stored, previous);
    if (share.twins.empty()) return bytes;
    std::vector<StoredGrid> all{stored};
    for (const auto& descriptor : share.twins) all.push_back(withDescriptor(stored, descriptor));
    return bytes + bytesAddedTogether(std::move(all)) - bytesAdded(stored);
  }

  std::optional<std::uint64_t> left_;  ///< bytes without those reserved
  double weightLeft_ = 0.0;
  std::uint64_t leastLeft_ = 0;  ///< the least bytes of the grids that have none yet
  bool isOverdrawn_ = false;
  std::vector<Share> shares_;  ///< one for each grid; that of a twin is not used
  bool isCompact_;
  EsvrFile records_;  ///< records of the grids that were taken, if the file is compact
  std::optional<std::uint64_t> saved_;
};

// Every grid of a file.

/// Converts the grids until all are done or the call is cancelled: small ones at the same time, and then one
/// after the other.
class GridsConversion {
 public:
  GridsConversion(const FileSource& source, const FileOptions& options, GridConverter& converter)
      : source_(source), options_(options), converter_(converter), made_(source.grids.size()) {}

  /// \return a conversion for each grid, or nothing for those that were not converted
  std::vector<std::optional<GridConversion>> run() {
    converter_.findScales();
    twins_ = findTwins(source_.grids, converter_);
    ByteShares shares(source_, options_.size, twins_, {}, isCompact());
    convertSmall();
    while (!convertAll(shares)) {
      earlier_ = std::exchange(made_, std::vector<std::optional<GridConversion>>(made_.size()));
      shares = ByteShares(source_, options_.size, twins_, needed_, isCompact());
      if (!isCompact() || !shares.isOverdrawn()) continue;
      // What a grid needs is known of its own bytes, of which a compact file saves an unknown number. A size that this
      // number decides may still do for grids that are each counted alone.
      isEachAlone_ = true;
      shares = ByteShares(source_, options_.size, twins_, needed_, isCompact());
    }
    isOverdrawn_ = shares.isOverdrawn();
    for (const auto& [g, twin] : twins_)
      if (made_[twin.of]) made_[g] = twinOf(*made_[twin.of], g, twin);
    return std::move(made_);
  }

  /// True if grids divide a size of a compact file. In large files they would gain little, and those of a sequence
  /// refer to the frame before.
  [[nodiscard]] bool isCompact() const {
    constexpr std::uint64_t kMostCompact = std::uint64_t{1} << 20;
    return options_.size && *options_.size <= kMostCompact && options_.shares && !isEachAlone_ &&
           !options_.previous.file && source_.grids.size() + source_.carried.size() > 1;
  }

  /// True if grids have more bytes than the size allows, so that the size of the file has to be looked at.
  [[nodiscard]] bool isOverdrawn() const { return isOverdrawn_; }

 private:
  /// Converts the small grids of a file that do not share bytes, at the same time, since each of them
  /// keeps few threads and little of a GPU busy.
  void convertSmall() {
    // A single fit takes the time that was asked for, and shows its progress.
    const ConvertOptions& convert = options_.convert;
    if (convert.fit.seconds || std::holds_alternative<FitGoal>(convert.goal)) return;
    if (options_.size || !options_.severalAtOnce || source_.grids.size() < 2) return;
    std::vector<std::size_t> small;
    for (std::size_t g = 0; g < made_.size(); ++g)
      if (!twins_.contains(g) && isSmall(source_.grids[g])) small.push_back(g);
    // The largest come first, so that none of them is left alone at the end.
    std::ranges::stable_sort(small, std::ranges::greater(),
                             [&](std::size_t g) { return source_.grids[g].activeVoxels; });
    encode::forEachAtOnce(small.size(), converter_.mostAtOnce(), [&](std::size_t i) {
      try {
        made_[small[i]] = converter_.make(small[i], {}, false);
      } catch (const DeviceError&) {  // it is converted again where another device can take over
      } catch (const Cancelled&) {
      }
    });
  }

  /// The order in which grids are converted. Those that share a size begin with the one that takes the fewest
  /// bytes for its voxels in the source, since it probably leaves most of its share to the others.
  [[nodiscard]] std::vector<std::size_t> order() const {
    std::vector<std::size_t> order(source_.grids.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto bytesEach = [&](std::size_t g) {
      const GridSource& grid = source_.grids[g];
      return double(grid.storedBytes) / double(grid.activeVoxels + 1);
    };
    if (options_.size) std::ranges::stable_sort(order, {}, bytesEach);
    return order;
  }

  /// Converts the grids that are not made yet, twins aside.
  /// \return false if one needs more bytes than its share, so that the size must be divided again
  bool convertAll(ByteShares& shares) {
    for (const std::size_t g : order()) {
      if (made_[g] || twins_.contains(g) || converter_.isCancelled()) continue;
      const std::uint64_t share = shares.of(g).value_or(0);
      try {
        convert(g, shares);
      } catch (const SizeTooSmall& error) {
        if (source_.grids.size() == 1) throw;
        // With other bytes another fit may need a few more. These steps end such a search soon.
        needed_[g] = share + std::max(error.missing, share / 8 + 8);
        return false;
      }
    }
    return true;
  }

  /// Takes what was made by an earlier division of the size, where its bytes suit this one too.
  bool takeEarlier(std::size_t g, ByteShares& shares) {
    if (earlier_.empty() || !earlier_[g]) return false;
    if (shares.take(g, earlier_[g]->conversion.grid, converter_.previousOf(g)) > 0) return false;
    made_[g] = std::move(earlier_[g]);
    return true;
  }

  /// Converts a grid to the bytes of its share. Each of its twins repeats a row of the table for
  /// every section. How many there are is known after a conversion only; where they exceed what is
  /// reserved for the twins, the grid is converted again to fewer bytes.
  void convert(std::size_t g, ByteShares& shares) try {
    if (takeEarlier(g, shares)) return;
    std::optional<std::uint64_t> bytes = shares.of(g);
    if (bytes) *bytes += shares.saved();
    GridConversion grid = converter_.make(g, {.bytes = bytes}, true);
    const auto excessOf = [&]() -> std::uint64_t {
      const BestSoFar completion;
      // No grid follows an interrupted one.
      return converter_.isCancelled()
                 ? 0
                 : shares.take(g, grid.conversion.grid, converter_.previousOf(g));
    };
    while (const std::uint64_t excess = excessOf()) {
      bytes = less(*bytes, excess);
      grid = converter_.make(g, {.bytes = bytes}, true);
    }
    made_[g] = std::move(grid);
  } catch (const Cancelled&) {  // before it had a result
  }

  const FileSource& source_;
  const FileOptions& options_;
  GridConverter& converter_;
  Twins twins_;
  LeastBytes needed_;
  bool isOverdrawn_ = false, isEachAlone_ = false;
  std::vector<std::optional<GridConversion>> made_;
  std::vector<std::optional<GridConversion>> earlier_;  ///< by another division of the size
};

// Vectors, and the file.

/// The grids that were converted. Vectors lack no component.
std::vector<GridConversion> completeOnes(const std::vector<GridSource>& grids,
                                         std::vector<std::optional<GridConversion>> made) {
  std::vector<GridConversion> complete;
  for (std::size_t g = 0; g < grids.size(); ++g) {
    const std::size_t first = g - grids[g].component.value_or(0);
    const std::size_t count = grids[g].component ? kComponents : 1;
    const auto all = std::span(made).subspan(first, count);
    if (std::ranges::all_of(all, [](const auto& grid) { return grid.has_value(); }))
      complete.push_back(*made[g]);
  }
  return complete;
}

/// A grid whose other twin is not there stands alone.
void forgetMissingTwins(std::vector<GridConversion>& grids) {
  for (GridConversion& grid : grids)
    if (grid.twinOf && std::ranges::count(grids, *grid.twinOf, &GridConversion::source) == 0)
      grid.twinOf.reset();
}

std::vector<StoredVector> vectorsOf(const std::vector<GridSource>& sources,
                                    const std::vector<GridConversion>& grids) {
  std::vector<StoredVector> vectors;
  for (std::size_t g = 0; g < grids.size(); ++g)
    if (const GridSource& source = sources[grids[g].source]; source.component == std::size_t{0})
      vectors.push_back({source.name, g});
  return vectors;
}

std::uint64_t bytesOfVector(const std::vector<GridConversion>& grids, const StoredVector& vector) {
  std::vector<StoredGrid> components;
  for (std::size_t c = 0; c < kComponents; ++c)
    components.push_back(grids[vector.first + c].conversion.grid);
  return bytesAddedTogether(std::move(components)) + bytesOfVectors({vector});
}

/// Carries the vectors that take fewer bytes unchanged than as converted components, unless an option
/// prescribes the representation or a size.
void carrySmallerVectors(const FileOptions& options, const GridConverter& converter,
                         FileSource& source, ConvertedFile& made) {
  if (options.convert.representation != Representation::kAuto ||
      options.convert.storage.form != Storage::kCompact || options.size)
    return;
  const std::vector<StoredVector> vectors = vectorsOf(source.grids, made.grids);
  const auto gridOf = [&](const StoredVector& vector) -> const GridSource& {
    return source.grids[made.grids[vector.first].source];
  };
  struct Unchanged {
    std::vector<CarriedGrid> grid;  ///< empty: the components are smaller
    std::uint64_t bytesOfComponents = 0;
  };
  std::vector<Unchanged> unchanged(vectors.size());
  const bool areSmall = std::ranges::all_of(
      vectors, [&](const StoredVector& vector) { return isSmall(gridOf(vector)); });
  encode::forEachAtOnce(vectors.size(), areSmall ? converter.mostAtOnce() : 1, [&](std::size_t v) {
    if (!gridOf(vectors[v]).readCarried) return;
    std::vector<CarriedGrid> whole{gridOf(vectors[v]).readCarried()};
    const std::uint64_t bytes = bytesOfVector(made.grids, vectors[v]);
    if (bytesOfCarried(whole) < bytes) unchanged[v] = {std::move(whole), bytes};
  });
  for (std::size_t v = 0; v < vectors.size(); ++v) {
    if (unchanged[v].grid.empty()) continue;
    CarriedGrid& carried = unchanged[v].grid.front();
    const std::size_t place = gridOf(vectors[v]).place;
    made.carriedVectors.push_back({place, unchanged[v].bytesOfComponents});
    const auto at = std::ranges::lower_bound(source.carried, place, {}, &CarriedGrid::place);
    carried.place = std::uint32_t(place);
    source.carried.insert(at, std::move(carried));
  }
  std::erase_if(made.grids, [&](const GridConversion& grid) {
    return std::ranges::count(made.carriedVectors, source.grids[grid.source].place,
                              &CarriedVector::place) > 0;
  });
}

/// Gives the carried grids their places among those that the file holds.
void placeCarried(const std::vector<GridSource>& sources, const std::vector<GridConversion>& grids,
                  std::vector<CarriedGrid>& carried) {
  std::size_t converted = 0;
  for (std::size_t c = 0; c < carried.size(); ++c) {
    while (converted < grids.size() && sources[grids[converted].source].place < carried[c].place)
      ++converted;
    carried[c].place = std::uint32_t(converted + c);
  }
}

void assemble(FileSource& source, ConvertedFile& made) {
  placeCarried(source.grids, made.grids, source.carried);
  EsvrFile& file = made.file;
  file.metadata = std::move(source.metadata);
  file.carried = std::move(source.carried);
  for (const GridConversion& grid : made.grids) file.grids.push_back(grid.conversion.grid);
  file.vectors = vectorsOf(source.grids, made.grids);
  if (!file.carried.empty()) file.layout = FileLayout::kCompact;  // each has two small sections
}

void requireSize(const EsvrFile& file, std::uint64_t size) {
  const std::size_t bytes = encodeEsvr(file).size();
  if (bytes > size)
    throw UsageError("the smallest file that was found takes " + std::to_string(bytes) +
                     " bytes; the size allows " + std::to_string(size) +
                     ", and to skip some grids makes room");
}

}  // namespace

std::string GridSource::storedName() const {
  return component ? componentName(name, *component) : name;
}

ConvertedFile convertGrids(FileSource source, const FileOptions& options) {
  const CancelScope scope(CancelScope::orToken(options.convert.fit.cancel));
  GridConverter converter(source.grids, options);
  ConvertedFile made;
  GridsConversion conversion(source, options, converter);
  made.grids = completeOnes(source.grids, conversion.run());
  made.interrupted = converter.isCancelled();
  {
    const Completion completion;
    if (!made.interrupted) carrySmallerVectors(options, converter, source, made);
    forgetMissingTwins(made.grids);
    assemble(source, made);
  }
  encode::shareGrids(options, converter, made);
  made.interrupted = converter.isCancelled();
  if (conversion.isOverdrawn() || conversion.isCompact()) {
    made.file.layout = FileLayout::kCompact;
    requireSize(made.file, *options.size);
  }
  return made;
}

}  // namespace esvr
