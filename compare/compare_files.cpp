#include "compare/compare_files.h"

#include <algorithm>
#include <array>
#include <utility>

#include "compare/baseline.h"
#include "compare/limits.h"
#include "compare/unfitted.h"
#include "esvr/error.h"
#include "esvr/mesh_distance.h"
#include "esvr/vector_metrics.h"

namespace esvr::compare {
namespace {

/// Indices of a grid in the two files; nothing if the candidate does not have it.
struct Pair {
  std::size_t reference = 0;
  std::optional<std::size_t> candidate;
};

std::optional<std::size_t> counterpart(const GridFile& file, const std::string& uniqueName) {
  const auto& grids = file.grids();
  const auto it = std::find_if(grids.begin(), grids.end(), [&](const ListedGrid& grid) {
    return grid.uniqueName == uniqueName;
  });
  if (it == grids.end()) return std::nullopt;
  return std::size_t(it - grids.begin());
}

/// Pairs all grids of the reference, and records the grids that only the candidate has.
std::vector<Pair> pairAll(const CheckOptions& options, const GridFile& reference,
                          const GridFile& candidate, CheckRecord& record) {
  std::vector<Pair> pairs;
  const auto isIgnored = [&](const ListedGrid& grid) {
    return options.ignored.contains(grid.uniqueName);
  };
  for (std::size_t g = 0; g < reference.grids().size(); ++g)
    if (const ListedGrid& grid = reference.grids()[g]; !isIgnored(grid))
      pairs.push_back({g, counterpart(candidate, grid.uniqueName)});
  for (const auto& grid : candidate.grids())
    if (!isIgnored(grid) && !counterpart(reference, grid.uniqueName)) {
      record.extra.push_back(grid.uniqueName);
      record.failures.push_back("grid \"" + grid.uniqueName + "\" is not in the reference");
    }
  return pairs;
}

/// Pairs a grid by "NAME" or "NAME=OTHER". If a grid's name contains "=", the whole text is a name.
Pair pairNamed(const GridFile& reference, const GridFile& candidate, const std::string& wanted) {
  const std::size_t split = counterpart(reference, wanted) ? std::string::npos : wanted.find('=');
  const std::string name = wanted.substr(0, split);
  const std::string other = split == std::string::npos ? wanted : wanted.substr(split + 1);
  return {reference.find(name), candidate.find(other)};
}

std::vector<Pair> choosePairs(const CheckOptions& options, const GridFile& reference,
                              const GridFile& candidate, CheckRecord& record) {
  if (options.grids.empty()) return pairAll(options, reference, candidate, record);
  std::vector<Pair> pairs;
  for (const auto& wanted : options.grids) pairs.push_back(pairNamed(reference, candidate, wanted));
  return pairs;
}

std::string joinedNames(const GridFile& file) {
  std::string list;
  for (const auto& grid : file.grids())
    list += (list.empty() ? "\"" : ", \"") + grid.uniqueName + '"';
  return list.empty() ? "none" : list;
}

void requirePairs(const std::vector<Pair>& pairs, const GridFile& reference,
                  const GridFile& candidate) {
  if (pairs.empty()) throw BadInput(reference.path().string() + ": no grid can be compared");
  if (std::none_of(pairs.begin(), pairs.end(), [](const Pair& p) { return p.candidate; }))
    throw BadInput("no grid of " + reference.path().string() + " (" + joinedNames(reference) +
                   ") is in " + candidate.path().string() + " (" + joinedNames(candidate) + ")");
}

/// \throws BadInput  nothing could be compared
void requireResults(const GridFile& reference, const CheckRecord& record) {
  if (!record.grids.empty() || !record.same.empty() || !record.failures.empty()) return;
  std::string text = reference.path().string() + ": no grid can be compared";
  for (const auto& line : record.skipped) text += "\n  " + line;
  throw BadInput(text);
}

bool disjoint(const Box& a, const Box& b) {
  const Box common{maxCoord(a.min, b.min), minCoord(a.max, b.max)};
  return common.empty();
}

/// Compares one pair of grids after the other, so that only two volumes are in memory at a time.
class Comparison {
 public:
  Comparison(const CheckOptions& options, const FilePair& files, TemporalComparison* temporal)
      : options_(options),
        reference_(files.reference),
        candidate_(files.candidate),
        temporal_(temporal) {
    const bool limit = options.limits[std::size_t(FigureId::kSsim)].has_value();
    ssim_ = options.ssim || limit || (options.baseline && baselineHasSsim(*options.baseline));
  }

  void run(const Pair& pair, CheckRecord& record) {
    const ListedGrid& listed = reference_.grids()[pair.reference];
    if (!pair.candidate) {
      record.failures.push_back("grid \"" + listed.uniqueName + "\" is missing in " +
                                candidate_.path().string());
      return;
    }
    const GridPair both{reference_, pair.reference, candidate_, *pair.candidate};
    if (isRetyped(both))
      record.failures.push_back(retypedText(both));
    else if (both.a().isVector && both.b().isVector && !haveSameBytes(both))
      compareVectorGrids(pair, listed.uniqueName, record);
    else if (!listed.comparable || (listed.empty && options_.grids.empty()))
      compareUnfitted(options_, both, record);
    else
      record.grids.push_back(compare(pair, listed.uniqueName, record));
  }
  [[nodiscard]] const std::vector<double>& ranges() const { return ranges_; }

 private:
  CheckedGrid compare(const Pair& pair, const std::string& name, CheckRecord& record) {
    const VolumeGrid a = reference_.read(pair.reference);
    const VolumeGrid b = candidate_.read(*pair.candidate);
    CheckedGrid grid{.name = name, .candidateName = candidate_.grids()[*pair.candidate].uniqueName};
    requireRange(a.volume, name);
    requireOverlap(a.volume, b.volume, name, record);
    grid.metrics = compareVolumes(a.volume, b.volume,
                                  {.box = options_.box, .peak = options_.peak, .ssim = ssim_});
    grid.figures = figuresOf(grid.metrics);
    addMeshDistance(grid, a, b);
    grid.differences = compareDescriptors(a.descriptor, b.descriptor);
    addDifferences(compareInactive(a.inactive, b.inactive), grid);
    addRange(a.volume);
    addTemporal(grid, a.volume, b.volume);
    return grid;
  }

  /// Adds a row for the lengths of the vectors and one for each component.
  void compareVectorGrids(const Pair& pair, const std::string& name, CheckRecord& record) {
    const VectorGrid a = reference_.readVectors(pair.reference);
    const VectorGrid b = candidate_.readVectors(*pair.candidate);
    const std::string& other = candidate_.grids()[*pair.candidate].uniqueName;
    const SparseVolume lengths = magnitudeOf(a.components);
    requireRange(lengths, name);
    requireOverlap(lengths, magnitudeOf(b.components), name, record);
    const VectorMetrics metrics = compareVectors(
        a.components, b.components, {.box = options_.box, .peak = options_.peak, .ssim = ssim_});
    record.grids.push_back({name, other, metrics.magnitude, figuresOf(metrics.magnitude),
                            compareDescriptors(a.descriptor, b.descriptor)});
    addDifferences(compareInactive(a.inactive, b.inactive), record.grids.back());
    addRange(lengths);
    addTemporal(record.grids.back(), lengths, magnitudeOf(b.components));
    for (std::size_t c = 0; c < kComponents; ++c) {
      const VolumeMetrics& m = metrics.components[c];
      record.grids.push_back({componentName(name, c), componentName(other, c), m, figuresOf(m),
                              backgroundDifferences(a, b, c)});
      addRange(a.components[c]);
      addTemporal(record.grids.back(), a.components[c], b.components[c]);
    }
  }

  static void addDifferences(const std::vector<Difference>& more, CheckedGrid& grid) {
    grid.differences.insert(grid.differences.end(), more.begin(), more.end());
  }

  /// The difference of the backgrounds of a component. That of x is one of the descriptors.
  static std::vector<Difference> backgroundDifferences(const VectorGrid& a, const VectorGrid& b,
                                                       std::size_t component) {
    if (component == 0) return {};
    GridDescriptor of, other;
    of.background = a.background[component];
    other.background = b.background[component];
    return compareDescriptors(of, other);
  }

  /// Adds the distance of the surfaces of level sets if there is a limit for it. It takes longer
  /// than all other figures.
  void addMeshDistance(CheckedGrid& grid, const VolumeGrid& a, const VolumeGrid& b) const {
    const auto figure = std::size_t(FigureId::kMeshDistance);
    if (options_.limits[figure] && a.descriptor.gridClass == GridClass::kLevelSet)
      grid.figures[figure] = meshDistance(a, b).voxels;
  }

  void addTemporal(CheckedGrid& grid, const SparseVolume& a, const SparseVolume& b) const {
    if (temporal_)
      grid.figures[std::size_t(FigureId::kPsnrTemporal)] = temporal_->compare(grid.name, a, b);
  }

  void addRange(const SparseVolume& reference) {
    const ValueRange range = activeRange(reference);
    ranges_.push_back(double(range.max) - double(range.min));
  }

  static void requireOverlap(const SparseVolume& a, const SparseVolume& b, const std::string& name,
                             CheckRecord& record) {
    if (!disjoint(activeBox(a), activeBox(b))) return;
    record.failures.push_back("grid \"" + name + "\": " +
                              (activeVoxelCount(b) == 0
                                   ? "the candidate has no active voxel"
                                   : "the active voxels lie in boxes that do not meet"));
  }

  /// Checks that the reference has an active voxel and a peak, without which PSNR and SSIM are not
  /// defined.
  void requireRange(const SparseVolume& reference, const std::string& name) const {
    const std::string grid = reference_.path().string() + ": grid \"" + name + "\": ";
    if (activeVoxelCount(reference) == 0) throw BadInput(grid + "it has no active voxel");
    const ValueRange range = activeRange(reference);
    if (!options_.peak && range.min == 0.0f && range.max == 0.0f)
      throw BadInput(grid + "every active voxel is 0, so PSNR has no peak; set it with --peak");
  }

  const CheckOptions& options_;
  const GridFile &reference_, &candidate_;
  TemporalComparison* temporal_;  ///< null: the files are no frames
  bool ssim_ = false;
  std::vector<double> ranges_;
};

}  // namespace

CheckRecord compareFiles(const CheckOptions& options, const FilePair& files,
                         TemporalComparison* temporal) {
  CheckRecord record;
  record.candidateBytes = files.candidate.bytes();
  const auto pairs = choosePairs(options, files.reference, files.candidate, record);
  requirePairs(pairs, files.reference, files.candidate);
  record.fileDifferences = compareMetadata(files.reference.metadata(), files.candidate.metadata(),
                                           std::array<std::string, 1>{kWriterKey});
  Comparison comparison(options, files, temporal);
  for (const Pair& pair : pairs) {
    if (files.cancel.cancelled()) throw Cancelled();
    comparison.run(pair, record);
  }
  requireResults(files.reference, record);
  judgeLimits(options, comparison.ranges(), record);
  judgeDifferences(options, record);
  return record;
}

}  // namespace esvr::compare
