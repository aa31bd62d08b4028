// Converts the grids of a file together: vectors get one scale, grids of equal voxels are converted once, small grids
// are converted at the same time, and vectors that are smaller unchanged are carried. grid_converter.cpp has the single grids; share_grids.cpp then lets
// voxels refer to those of another grid. For a size, this is repeated with other qualities.
#include "esvr/convert_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <variant>

#include "core/add_seconds.h"
#include "core/counted.h"
#include "encode/grids_of_file.h"
#include "encode/root_search.h"
#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {

namespace {

using encode::GridConverter;
using encode::isSmall;
using encode::RootSearch;

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

// Every grid of a file.

/// Converts the grids that are no twins, until all are done or the call is cancelled: small ones at the same time,
/// and then one after the other.
class GridsConversion {
 public:
  GridsConversion(const std::vector<GridSource>& grids, const FileOptions& options,
                  GridConverter& converter, const Twins& twins)
      : grids_(grids),
        options_(options),
        converter_(converter),
        twins_(twins),
        made_(grids.size()) {}

  /// \return a conversion for each grid, or nothing for those that were not converted
  std::vector<std::optional<GridConversion>> run() {
    convertSmall();
    for (std::size_t g = 0; g < made_.size() && !converter_.isCancelled(); ++g)
      if (!made_[g] && !twins_.contains(g)) convert(g);
    for (const auto& [g, twin] : twins_)
      if (made_[twin.of]) made_[g] = twinOf(*made_[twin.of], g, twin);
    return std::move(made_);
  }

 private:
  /// Converts the small grids of a file at the same time, since each of them keeps few threads and little of a GPU
  /// busy.
  void convertSmall() {
    // A single fit takes the time that was asked for, and shows its progress.
    const ConvertOptions& convert = options_.convert;
    if (convert.fit.seconds || std::holds_alternative<FitGoal>(convert.goal)) return;
    if (!options_.severalAtOnce || grids_.size() < 2) return;
    std::vector<std::size_t> small;
    for (std::size_t g = 0; g < made_.size(); ++g)
      if (!twins_.contains(g) && isSmall(grids_[g])) small.push_back(g);
    // The largest come first, so that none of them is left alone at the end.
    std::ranges::stable_sort(small, std::ranges::greater(),
                             [&](std::size_t g) { return grids_[g].activeVoxels; });
    encode::forEachAtOnce(small.size(), converter_.mostAtOnce(), [&](std::size_t i) {
      try {
        made_[small[i]] = converter_.make(small[i], false);
      } catch (const DeviceError&) {  // it is converted again where another device can take over
      } catch (const Cancelled&) {
      }
    });
  }

  void convert(std::size_t g) try {
    made_[g] = converter_.make(g, true);
  } catch (const Cancelled&) {  // before it had a result
  }

  const std::vector<GridSource>& grids_;
  const FileOptions& options_;
  GridConverter& converter_;
  const Twins& twins_;
  std::vector<std::optional<GridConversion>> made_;
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
/// prescribes the representation.
void carrySmallerVectors(const FileOptions& options, const GridConverter& converter,
                         FileSource& source, ConvertedFile& made) {
  if (options.convert.representation != Representation::kAuto ||
      options.convert.storage.form != Storage::kCompact)
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

/// Converts all grids with the goals that the converter has.
ConvertedFile convertOnce(FileSource source, const FileOptions& options, GridConverter& converter,
                          const Twins& twins) {
  ConvertedFile made;
  made.grids =
      completeOnes(source.grids, GridsConversion(source.grids, options, converter, twins).run());
  made.interrupted = converter.isCancelled();
  {
    const Completion completion;
    if (!made.interrupted) carrySmallerVectors(options, converter, source, made);
    forgetMissingTwins(made.grids);
    assemble(source, made);
  }
  encode::shareGrids(options, converter, made);
  made.interrupted = converter.isCancelled();
  return made;
}

// A size.

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

/// Finds the quality that all grids of a file can have within its size. Who looks at all grids wants them to be equally
/// good, and grids with a quality refer to each other and to the frame before.
class SizeSearch {
 public:
  SizeSearch(const FileSource& source, const FileOptions& options, GridConverter& converter,
             const Twins& twins)
      : source_(source),
        options_(options),
        converter_(converter),
        twins_(twins),
        seconds_(source.grids.size()),
        betterAsVoxels_(source.grids.size(), std::numeric_limits<double>::infinity()) {}

  ConvertedFile run() {
    const double size = double(*options_.size), first = options_.previous.abovePreset;
    RootSearch search({kLeast, kMost, kNarrowest, kLongest, true}, std::log2(kAimedShare * size),
                      kOctavesPerDb, first);
    double before = 0.0;
    for (int trial = 0; !search.ended() && (trial < kMostTrials || !best_); ++trial) {
      const double bytes = double(tryQuality(search.next()));
      if (converter_.isCancelled()) break;
      const double enough = trial == 0 && options_.previous.file ? kEnoughOfFrame : kEnough;
      if (enough * size <= bytes && bytes <= size) break;
      // No voxel changes any more.
      if (std::exchange(before, bytes) == bytes && bytes <= size) break;
      // Far from the size, exact voxels may keep to it, too.
      if (trial == 0 && mayBeExact() && kFar * bytes < size && double(tryQuality(kExact)) <= size)
        break;
      search.learn(std::log2(bytes));
    }
    const bool isCancelled = converter_.isCancelled();
    if (!best_ && isCancelled) best_ = std::move(smallest_);
    if (!best_)
      throw UsageError("the smallest file that was found takes " + std::to_string(*fewest_) +
                       " bytes; the size allows " + std::to_string(*options_.size) +
                       ", and to skip some grids makes room");
    best_->interrupted = isCancelled;
    for (GridConversion& grid : best_->grids) grid.secondsConvert = seconds_[grid.source];
    converter_.tellAll(best_->grids);
    return std::move(*best_);
  }

 private:
  /// dB above the quality of the preset: from nearly nothing to single bits of floats, and what only exact voxels have.
  static constexpr double kLeast = -36.0, kMost = 90.0, kExact = 150.0;
  static constexpr double kNarrowest = 0.05;  ///< dB that are hardly seen
  /// Fits of much more than the size would take long.
  static constexpr double kLongest = 10.0;
  /// Bytes of gas_0004 double with 11 to 16 dB, those of fluid_data_0041 with 11 and those of smooth fits with 3 to 6.
  static constexpr double kOctavesPerDb = 0.1;
  /// Shares of the size that are aimed at, and that are enough. Frames vary by more than the search is worth.
  static constexpr double kAimedShare = 0.96, kEnough = 0.92, kEnoughOfFrame = 0.88;
  static constexpr double kFar =
      4.0;  ///< a size is far above the bytes of the preset from this factor on
  static constexpr int kMostTrials = 6;

  [[nodiscard]] bool mayBeExact() const {
    return options_.convert.representation != Representation::kEllipsoids;
  }

  /// Converts the file with a quality, and keeps it if it is the best one that keeps to the size.
  /// \return its bytes
  std::uint64_t tryQuality(double abovePreset) {
    std::vector<bool> asVoxels(betterAsVoxels_.size());
    for (std::size_t g = 0; g < asVoxels.size(); ++g)
      asVoxels[g] = abovePreset >= betterAsVoxels_[g];
    converter_.tryGoal(PresetGoal{abovePreset}, std::move(asVoxels));
    ConvertedFile made = convertOnce(source_, options_, converter_, twins_);
    const std::uint64_t bytes = bytesOf(made.file);
    if (!made.interrupted) fewest_ = std::min(fewest_.value_or(bytes), bytes);
    for (const GridConversion& grid : made.grids) learnFrom(grid, abovePreset);
    made.abovePreset = abovePreset;
    made.isTooLarge = bytes > *options_.size;
    if (!best_ && made.isTooLarge) {
      if (!smallest_ || (!made.interrupted && bytes == *fewest_)) smallest_ = std::move(made);
      return bytes;
    }
    // Grids that are missing are worse than a file that is too large.
    const bool isWorse =
        (best_ && best_->abovePreset >= abovePreset) || (made.interrupted && (best_ || smallest_));
    if (!made.isTooLarge && !isWorse) best_ = std::move(made), smallest_.reset();
    return bytes;
  }

  /// Where voxels are better than ellipsoids, they are at any higher quality.
  void learnFrom(const GridConversion& grid, double abovePreset) {
    seconds_[grid.source] += grid.secondsConvert;
    const auto& choice = grid.conversion.choice;
    if (grid.conversion.grid.voxels && choice && choice->ellipsoids)
      betterAsVoxels_[grid.source] = std::min(betterAsVoxels_[grid.source], abovePreset);
  }

  [[nodiscard]] std::uint64_t bytesOf(const EsvrFile& file) const {
    const Completion completion;
    const EsvrFile* const before = options_.previous.file;
    return encodeFrame(file, before && haveSameGrids(file, *before) ? before : nullptr).size();
  }

  const FileSource& source_;
  const FileOptions& options_;
  GridConverter& converter_;
  const Twins& twins_;
  std::optional<ConvertedFile> best_;      ///< the best file that keeps to the size
  std::optional<ConvertedFile> smallest_;  ///< the smallest file, as long as none keeps to the size
  std::optional<std::uint64_t> fewest_;
  std::vector<double> seconds_;  ///< time that all conversions of each grid took
  /// PresetGoal::abovePreset from which on each grid is better as voxels.
  std::vector<double> betterAsVoxels_;
};

/// Converts the grids to a file of at most a size.
ConvertedFile convertToSize(const FileSource& source, const FileOptions& options,
                            GridConverter& converter, const Twins& twins) {
  const std::uint64_t beside = bytesBesideConverted(source, *options.size);
  if (source.grids.size() > 1 || options.previous.file)
    return SizeSearch(source, options, converter, twins).run();
  converter.setGoal(SizeGoal{*options.size - beside});
  ConvertedFile made = convertOnce(source, options, converter, twins);
  if (!made.grids.empty()) made.abovePreset = made.grids.front().conversion.abovePreset;
  return made;
}

}  // namespace

std::string GridSource::storedName() const {
  return component ? componentName(name, *component) : name;
}

ConvertedFile convertGrids(FileSource source, const FileOptions& options) {
  const CancelScope scope(CancelScope::orToken(options.convert.fit.cancel));
  GridConverter converter(source.grids, options);
  converter.findScales();
  const Twins twins = findTwins(source.grids, converter);
  const bool isEmpty = source.grids.empty() && source.carried.empty();
  if (options.size && !isEmpty) return convertToSize(source, options, converter, twins);
  return convertOnce(source, options, converter, twins);
}

}  // namespace esvr
