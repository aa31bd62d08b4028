// Which grids of two files belong together, what they differ in, and how large the errors are.

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

#include "compare/check.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "programs/option_values.h"
#include "programs/run_main.h"

namespace esvr::compare {

// Pairs of grids.

namespace {

/// Indices of a grid in the two files; nothing if the candidate does not have it.
struct Pair {
  std::size_t reference = 0;
  std::optional<std::size_t> candidate;
};

/// Grids that --ignore-grids names are left out. Where both files have the same number of grids of
/// a name, it stands for the grids with this number in both. Where the candidate has fewer, it stands for
/// the grid of the reference alone; the other grids of the reference are then paired with the candidate's.
class Pairing {
 public:
  Pairing(const CheckOptions& options, const GridFile& reference, const GridFile& candidate)
      : options_(options), reference_(reference), candidate_(candidate) {
    std::vector<GridTraits> traits;
    std::vector<std::size_t> places;
    const auto counts = countsOf(reference), others = countsOf(candidate);
    for (std::size_t g = 0; g < reference.grids().size(); ++g) {
      const std::string& name = reference.grids()[g].name;
      const auto other = others.find(name);
      const bool isOneOfMany = other != others.end() && other->second != counts.at(name);
      if (isOneOfMany && isIgnored(reference, g)) continue;
      traits.push_back(reference.traits()[g]);
      places.push_back(g);
    }
    of_.resize(reference.grids().size());
    auto ofCandidate = candidate.traits();
    cli::addRanges(
        ofCandidate, [&](std::size_t g) { return rangeOf(reference, places[g]); }, traits);
    cli::addRanges(
        traits, [&](std::size_t g) { return rangeOf(candidate, g); }, ofCandidate);
    const auto pairs = pairGrids(traits, ofCandidate);
    for (std::size_t p = 0; p < pairs.size(); ++p) of_[places[p]] = pairs[p];
  }

  /// The grid of the candidate that is the same as one of the reference.
  [[nodiscard]] std::optional<std::size_t> of(std::size_t reference) const {
    return of_[reference];
  }

  /// Pairs all grids of the reference, and records the grids that only the candidate has.
  [[nodiscard]] std::vector<Pair> all(CheckRecord& record) const {
    std::vector<Pair> pairs;
    std::vector<bool> isPaired(candidate_.grids().size(), false);
    for (std::size_t g = 0; g < reference_.grids().size(); ++g) {
      if (of_[g]) isPaired[*of_[g]] = true;
      if (!isIgnored(reference_, g)) pairs.push_back({g, of_[g]});
    }
    for (std::size_t g = 0; g < isPaired.size(); ++g) {
      if (isPaired[g] || isIgnored(candidate_, g)) continue;
      const std::string& name = candidate_.grids()[g].uniqueName;
      record.extra.push_back(name);
      record.failures.push_back("grid \"" + name + "\" is not in the reference");
    }
    return pairs;
  }

 private:
  static std::map<std::string, std::size_t> countsOf(const GridFile& file) {
    std::map<std::string, std::size_t> counts;
    for (const ListedGrid& grid : file.grids()) ++counts[grid.name];
    return counts;
  }

  /// The range of the active values of a grid.
  static std::optional<std::array<float, 2>> rangeOf(const GridFile& file, std::size_t grid) {
    const ListedGrid& listed = file.grids()[grid];
    if (listed.empty || !(listed.comparable || listed.isVector)) return std::nullopt;
    const ValueRange range = activeRange(listed.isVector ? file.readVectors(grid).components.front()
                                                         : file.read(grid).volume);
    return std::array{range.min, range.max};
  }

  [[nodiscard]] bool isIgnored(const GridFile& file, std::size_t grid) const {
    return std::ranges::any_of(options_.ignored, [&](const std::string& name) {
      return name == file.grids()[grid].name || file.names().lookUp(name) == NamedGrid{grid};
    });
  }

  const CheckOptions& options_;
  const GridFile &reference_, &candidate_;
  std::vector<std::optional<std::size_t>> of_;  ///< by the place in the reference
};

/// Pairs a grid by "NAME" or "NAME=OTHER". If a grid's name contains "=", the whole text is a name.
Pair pairNamed(const GridFile& reference, const GridFile& candidate, const Pairing& pairing,
               const std::string& wanted) {
  const bool isWhole = reference.names().lookUp(wanted).has_value();
  const std::size_t split = isWhole ? std::string::npos : wanted.find('=');
  const std::size_t place = reference.find(wanted.substr(0, split));
  if (split != std::string::npos) return {place, candidate.find(wanted.substr(split + 1))};
  const auto same = pairing.of(place);
  return {place, same ? *same : candidate.find(wanted)};
}

std::vector<Pair> choosePairs(const CheckOptions& options, const GridFile& reference,
                              const GridFile& candidate, CheckRecord& record) {
  const Pairing pairing(options, reference, candidate);
  if (options.grids.empty()) return pairing.all(record);
  std::vector<Pair> pairs;
  for (const auto& wanted : options.grids)
    pairs.push_back(pairNamed(reference, candidate, pairing, wanted));
  return pairs;
}

void requirePairs(const std::vector<Pair>& pairs, const GridFile& reference,
                  const GridFile& candidate) {
  // A file without grids is the first frame of many simulations, and compares like any other.
  if (reference.grids().empty() || candidate.grids().empty()) return;
  if (pairs.empty()) throw BadInput(reference.path().string() + ": no grid can be compared");
  if (std::none_of(pairs.begin(), pairs.end(), [](const Pair& p) { return p.candidate; }))
    throw BadInput("no grid of " + reference.path().string() + " (" + reference.names().list() +
                   ") is in " + candidate.path().string() + " (" + candidate.names().list() + ")");
}

/// \throws BadInput  nothing could be compared
void requireResults(const GridFile& reference, const CheckRecord& record) {
  if (!record.grids.empty() || !record.same.empty() || !record.failures.empty() ||
      !record.unreadable.empty())
    return;
  std::string text = reference.path().string() + ": no grid can be compared";
  for (const auto& line : record.skipped) text += "\n  " + line;
  throw BadInput(text);
}

}  // namespace

// Differences besides the voxels.

namespace {

/// OpenVDB's metadata items that repeat members of a descriptor.
const std::array<std::string, 3> kRepeated{"name", "class", "is_saved_as_half_float"};

constexpr double kEntryTolerance = 1e-12;  // relative to the largest entry: float64 rounding

/// Appends the difference of two transforms. They are equal if the bytes of their maps are, or if
/// both are affine and no entry of the matrices differs by more than 1e-12 of the largest, since
/// NanoVDB stores maps in another form with rounding.
void addTransform(const Transform& a, const Transform& b, std::vector<Difference>& list) {
  if (a == b) return;
  std::string how;
  if (a.affine && b.affine) {
    const std::array<double, 16>&m = *a.affine, &n = *b.affine;
    double by = 0.0, largest = 0.0;
    for (std::size_t i = 0; i < m.size(); ++i) {
      by = std::max(by, std::abs(m[i] - n[i]));
      largest = std::max({largest, std::abs(m[i]), std::abs(n[i])});
    }
    if (by <= kEntryTolerance * largest) return;
    how = " (matrices differ by up to " + cli::shortNumber(by) + ")";
  }
  list.push_back(
      {DifferenceKind::kTransform, "transform: " + a.mapType + ", another " + b.mapType + how});
}

std::map<std::string, const MetaItem*> byName(std::span<const MetaItem> items) {
  std::map<std::string, const MetaItem*> found;
  for (const auto& item : items) found[item.name] = &item;
  return found;
}

Difference metadataDifference(const std::string& name, const std::string& how) {
  return {DifferenceKind::kMetadata,
          "metadata \"" + shownText(name, LineEnds::kReplace) + "\": " + how};
}

/// Lists the items that only one side has or that have different values, except for `ignored`.
std::vector<Difference> compareMetadata(std::span<const MetaItem> reference,
                                        std::span<const MetaItem> candidate,
                                        std::span<const std::string> ignored) {
  const auto isIgnored = [&](const std::string& name) {
    return std::find(ignored.begin(), ignored.end(), name) != ignored.end();
  };
  const auto a = byName(reference), b = byName(candidate);
  std::vector<Difference> differences;
  for (const auto& [name, item] : a) {
    if (isIgnored(name)) continue;
    const auto other = b.find(name);
    if (other == b.end())
      differences.push_back(metadataDifference(name, "missing"));
    else if (*other->second != *item)
      differences.push_back(metadataDifference(name, "another value"));
  }
  for (const auto& [name, item] : b)
    if (!isIgnored(name) && !a.contains(name))
      differences.push_back(metadataDifference(name, "not in the reference"));
  return differences;
}

/// The difference of the values of inactive voxels; nothing if they are the same.
std::vector<Difference> compareInactive(const InactiveValues& reference,
                                        const InactiveValues& candidate) {
  if (reference == candidate) return {};
  const auto text = [](const InactiveValues& values) {
    return values.count() == 0 ? "none" : toText(values);
  };
  return {{DifferenceKind::kInactive,
           "inactive values that are not the background: " + text(reference) +
               ", in the candidate " + text(candidate)}};
}

/// Lists the differences of two descriptors. Metadata items that repeat the name, the class or the
/// value type are ignored.
std::vector<Difference> compareDescriptors(const GridDescriptor& a, const GridDescriptor& b) {
  std::vector<Difference> list;
  const auto add = [&](DifferenceKind kind, const std::string& what, const std::string& reference,
                       const std::string& candidate) {
    if (reference != candidate) list.push_back({kind, what + ": " + reference + ", " + candidate});
  };
  add(DifferenceKind::kName, "name", '"' + a.name + '"', '"' + b.name + '"');
  add(DifferenceKind::kClass, "class", className(a.gridClass), className(b.gridClass));
  add(DifferenceKind::kValueType, "value type", cli::nameOf(a.valueType), cli::nameOf(b.valueType));
  if (a.background != b.background)
    add(DifferenceKind::kBackground, "background", cli::shortNumber(a.background),
        cli::shortNumber(b.background) + " (by " + cli::shortNumber(b.background - a.background) +
            ")");
  addTransform(a.transform, b.transform, list);
  std::ranges::move(compareMetadata(a.metadata, b.metadata, kRepeated), std::back_inserter(list));
  return list;
}

}  // namespace

// Grids without figures: those whose values are not floats or doubles, and those without an active
// voxel.

namespace {

/// Indices of a grid in the two files.
struct GridPair {
  const GridFile& reference;
  std::size_t ofReference = 0;
  const GridFile& candidate;
  std::size_t ofCandidate = 0;

  [[nodiscard]] const ListedGrid& a() const { return reference.grids()[ofReference]; }
  [[nodiscard]] const ListedGrid& b() const { return candidate.grids()[ofCandidate]; }
};

constexpr const char* kDouble = "double";

std::string lineOf(const GridPair& pair) { return "grid \"" + pair.a().uniqueName + "\": "; }

/// True if two grids have the same bytes, wherever they are in their files.
bool areEqual(CarriedGrid a, CarriedGrid b) {
  a.place = b.place = 0;
  return a == b;
}

/// True if the two grids are of types that cannot be compared with each other, or if one is of
/// doubles and the other one is not.
bool isRetyped(const GridPair& pair) {
  if (!pair.a().comparable || !pair.b().comparable) return pair.a().valueType != pair.b().valueType;
  return (pair.a().valueType == kDouble) != (pair.b().valueType == kDouble);
}

/// True if two grids have the same bytes in files without loss. They are read only if both files
/// have them.
bool haveSameBytes(const GridPair& pair) {
  if (!pair.reference.hasBytes(pair.ofReference) || !pair.candidate.hasBytes(pair.ofCandidate))
    return false;
  const bool areVdb = !pair.reference.esvr() && !pair.candidate.esvr();
  if (areVdb && pair.a().storedBytes != pair.b().storedBytes) return false;
  const auto a = pair.reference.bytesOf(pair.ofReference);
  const auto b = pair.candidate.bytesOf(pair.ofCandidate);
  return a && b && areEqual(*a, *b);
}

/// Compares two grids of floats or doubles, of which the reference has no active voxel.
void compareEmpty(const CheckOptions& options, const GridPair& pair, CheckRecord& record) {
  const VolumeGrid a = pair.reference.read(pair.ofReference);
  const VolumeGrid b = pair.candidate.read(pair.ofCandidate);
  if (const auto voxels = activeVoxelCount(b.volume); voxels > 0)
    record.failures.push_back(lineOf(pair) + "the candidate has " +
                              cli::counted(voxels, "active voxel") + ", the reference has none");
  else
    record.same.push_back(lineOf(pair) + "no active voxel in either file");
  auto differences = compareDescriptors(a.descriptor, b.descriptor);
  for (auto& difference : compareInactive(a.inactive, b.inactive))
    differences.push_back(std::move(difference));
  for (const auto& difference : differences) {
    const bool fails = options.failOn.contains(difference.kind);
    (fails ? record.failures : record.notes).push_back(lineOf(pair) + difference.text);
  }
}

/// Compares two grids whose bytes are the same in files without loss. Appends a line to the
/// record's `same`, `failures` or, where one of the files is not a .vdb or .esvr file, `skipped`.
void compareUnfitted(const CheckOptions& options, const GridPair& pair, CheckRecord& record) {
  const auto a = pair.reference.bytesOf(pair.ofReference);
  const auto b = pair.candidate.bytesOf(pair.ofCandidate);
  if (a && b && areEqual(*a, *b))
    record.same.push_back(lineOf(pair) + "the same bytes (" + pair.a().valueType + ")");
  else if (pair.a().comparable)
    compareEmpty(options, pair, record);
  else if (a && b)
    record.failures.push_back(lineOf(pair) + "its bytes differ; its values are of type " +
                              pair.a().valueType + ", which is compared bit for bit");
  else
    record.skipped.push_back(lineOf(pair) + "its values are of type " + pair.a().valueType);
}

}  // namespace

// Changes from frame to frame.

void TemporalComparison::beginFrame() { before_ = std::exchange(current_, {}); }

std::optional<double> TemporalComparison::compare(const std::string& grid,
                                                  const ComparedVolumes& now) {
  current_[grid] = {now.reference, now.candidate, now.peak};
  const auto found = before_.find(grid);
  if (found == before_.end()) return std::nullopt;
  const Volumes& before = found->second;
  return temporalPsnr({before.reference, now.reference}, {before.candidate, now.candidate},
                      {.box = options_.box, .peak = std::max(before.peak, now.peak)});
}

// Figures.

namespace {

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
    const bool areVectors = both.a().isVector && both.b().isVector;
    if (isRetyped(both))
      record.failures.push_back(lineOf(both) + "its values are of type " + both.b().valueType +
                                " in the candidate, " + both.a().valueType + " in the reference");
    else if (!(listed.comparable || areVectors) || listed.empty)
      compareUnfitted(options_, both, record);
    else if (haveSameBytes(both) && !(temporal_ && hasFigures(both)))
      addSame(both, record);
    else
      measure(both, record);
  }

 private:
  /// True if grids of the same bytes get a row of figures. Those that an .esvr file carries are
  /// listed with the other carried grids.
  static bool hasFigures(const GridPair& both) {
    return both.a().comparable && !both.reference.esvr() && !both.candidate.esvr();
  }

  /// Two grids of the same bytes are equal, whatever their values, and need not be read.
  void addSame(const GridPair& both, CheckRecord& record) const {
    if (!hasFigures(both)) {
      record.same.push_back(lineOf(both) + "the same bytes (" + both.a().valueType + ")");
      return;
    }
    CheckedGrid grid{.name = both.a().uniqueName, .candidateName = both.b().uniqueName};
    constexpr double kExact = std::numeric_limits<double>::infinity();
    VolumeMetrics exact;
    exact.psnrBox = exact.psnrActive = kExact;
    exact.transmittance = {0.0, kExact, kExact, kExact};
    if (ssim_) exact.ssim = 1.0;
    grid.figures = figuresOf(exact);
    const auto distance = std::size_t(FigureId::kMeshDistance);
    const auto relative = std::size_t(FigureId::kRelativeError);
    if (options_.limits[distance]) grid.figures[distance] = 0.0;
    if (options_.limits[relative]) grid.figures[relative] = 0.0;
    record.grids.push_back(std::move(grid));
  }

  /// A grid that cannot be measured, because a value is not finite for example, does not keep the
  /// others from being compared.
  void measure(const GridPair& both, CheckRecord& record) try {
    if (both.a().isVector)
      compareVectorGrids(both, record);
    else
      record.grids.push_back(compare(both, record));
  } catch (const BadInput& why) {
    record.unreadable.push_back("grid \"" + both.a().uniqueName +
                                "\" cannot be compared: " + why.what());
  }

  CheckedGrid compare(const GridPair& both, CheckRecord& record) {
    const VolumeGrid a = both.reference.read(both.ofReference);
    const VolumeGrid b = both.candidate.read(both.ofCandidate);
    CheckedGrid grid{.name = both.a().uniqueName, .candidateName = both.b().uniqueName};
    requireOverlap(both, a.volume, b.volume, record);
    grid.metrics =
        compareVolumes(a.volume, b.volume,
                       {.box = options_.box,
                        .peak = options_.peak,
                        .ssim = ssim_,
                        .transmittance = isLookedThrough(a.descriptor.gridClass, a.volume),
                        .narrowing = between(a.narrowing, b.narrowing)});
    grid.figures = figuresOf(grid.metrics);
    addMeshDistance(grid, a, b);
    addRelativeError(grid, a.volume, b.volume, between(a.narrowing, b.narrowing));
    grid.differences = compareDescriptors(a.descriptor, b.descriptor);
    addDifferences(compareInactive(a.inactive, b.inactive), grid);
    grid.range = valueRangeOf(a.volume);
    addTemporal(grid, {a.volume, b.volume, grid.metrics.peak});
    return grid;
  }

  /// Adds a row for the lengths of the vectors and one for each component.
  void compareVectorGrids(const GridPair& both, CheckRecord& record) {
    const VectorGrid a = both.reference.readVectors(both.ofReference);
    const VectorGrid b = both.candidate.readVectors(both.ofCandidate);
    const SparseVolume lengths = magnitudeOf(a.components), others = magnitudeOf(b.components);
    requireOverlap(both, lengths, others, record);
    const auto narrowing = between(a.narrowing, b.narrowing);
    const VectorMetrics metrics =
        compareVectors(a.components, b.components,
                       {.box = options_.box, .peak = options_.peak, .ssim = ssim_}, narrowing);
    const double range = valueRangeOfVectors(a.components), peak = metrics.magnitude.peak;
    record.grids.push_back({.name = both.a().uniqueName,
                            .candidateName = both.b().uniqueName,
                            .metrics = metrics.magnitude,
                            .figures = figuresOf(metrics.magnitude),
                            .differences = compareDescriptors(a.descriptor, b.descriptor),
                            .range = range,
                            .vectors = LimitedRows::kLengths});
    addDifferences(compareInactive(a.inactive, b.inactive), record.grids.back());
    addTemporal(record.grids.back(), {lengths, others, peak});
    for (std::size_t c = 0; c < kComponents; ++c) {
      const VolumeMetrics& m = metrics.components[c];
      record.grids.push_back({.name = reference_.names().ofComponent(both.ofReference, c),
                              .candidateName = candidate_.names().ofComponent(both.ofCandidate, c),
                              .metrics = m,
                              .figures = figuresOf(m),
                              .differences = backgroundDifferences(a, b, c),
                              .range = range,
                              .vectors = LimitedRows::kComponents});
      addRelativeError(record.grids.back(), a.components[c], b.components[c], narrowing[c]);
      addTemporal(record.grids.back(), {a.components[c], b.components[c], peak});
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
    if (!options_.limits[figure] || a.descriptor.gridClass != GridClass::kLevelSet) return;
    if (grid.metrics.nonFinite == 0) {
      grid.figures[figure] = meshDistance(a, b).voxels;
      return;
    }
    VolumeGrid c = a, d = b;  // no surface passes where there is no distance
    dropNonFinite(c.volume);
    dropNonFinite(d.volume);
    grid.figures[figure] = meshDistance(c, d).voxels;
  }

  void addRelativeError(CheckedGrid& grid, const SparseVolume& a, const SparseVolume& b,
                        const Narrowing& narrowing) const {
    const auto figure = std::size_t(FigureId::kRelativeError);
    if (options_.limits[figure])
      grid.figures[figure] = largestRelativeError(a, b, options_.relativeFloor).share +
                             narrowing.relativeAbove(options_.relativeFloor);
  }

  void addTemporal(CheckedGrid& grid, const ComparedVolumes& volumes) const {
    if (temporal_)
      grid.figures[std::size_t(FigureId::kPsnrTemporal)] = temporal_->compare(grid.name, volumes);
  }

  static void requireOverlap(const GridPair& both, const SparseVolume& a, const SparseVolume& b,
                             CheckRecord& record) {
    if (!common(activeBox(a), activeBox(b)).empty()) return;
    record.failures.push_back(lineOf(both) +
                              (activeVoxelCount(b) == 0
                                   ? "the candidate has no active voxel"
                                   : "the active voxels lie in boxes that do not meet"));
  }

  const CheckOptions& options_;
  const GridFile &reference_, &candidate_;
  TemporalComparison* temporal_;  ///< null: the files are no frames
  bool ssim_ = false;
};

}  // namespace

CheckRecord compareFiles(const CheckOptions& options, const FilePair& files,
                         TemporalComparison* temporal) {
  CheckRecord record;
  record.candidateBytes = files.candidate.bytes();
  const auto pairs = choosePairs(options, files.reference, files.candidate, record);
  if (files.reference.grids().empty() && files.candidate.grids().empty())
    record.same.emplace_back("no grid in either file");
  requirePairs(pairs, files.reference, files.candidate);
  record.fileDifferences = compareMetadata(files.reference.metadata(), files.candidate.metadata(),
                                           std::array<std::string, 1>{kWriterKey});
  Comparison comparison(options, files, temporal);
  for (const Pair& pair : pairs) {
    if (files.cancel.cancelled()) throw Cancelled();
    comparison.run(pair, record);
  }
  requireResults(files.reference, record);
  judgeLimits(options, record);
  judgeDifferences(options, record);
  return record;
}

}  // namespace esvr::compare
