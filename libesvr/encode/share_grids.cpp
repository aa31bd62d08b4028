// What the grids of a file share: the grid that the voxels of another one refer to, voxels that are chosen again for this
// coding, and the bytes that it saves.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <variant>
#include <vector>

#include "codec/voxel_coder.h"
#include "core/add_seconds.h"
#include "core/parallel.h"
#include "encode/grids_of_file.h"
#include "encode/voxels.h"
#include "esvr/error.h"
#include "format/section_table.h"
#include "format/voxel_sections.h"

namespace esvr {

// ---- The grid that is most alike

namespace {

/// Bricks of the sample on which candidates are compared: one run (sampledBricks). Coding them takes about 10 ms.
constexpr std::size_t kSampleBricks = 64;
/// Candidates that are tried on the sample, of those that are most alike.
constexpr std::size_t kMostTried = 4;

Coord brickIn(const VoxelLayer& layer, Coord brick, const VoxelLayer& other) {
  return brick + brickOf(layer.origin - other.origin);
}

/// The bricks of a layer that the sample has or touches.
VoxelLayer partNear(const VoxelLayer& layer, const VoxelLayer& sample) {
  std::set<Coord> near;
  for (const Coord brick : sample.bricks)
    for (int n = 0; n < 27; ++n)
      near.insert(brickIn(sample, brick, layer) + Coord{n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1});
  std::vector<std::size_t> chosen;
  for (std::size_t b = 0; b < layer.bricks.size(); ++b)
    if (near.contains(layer.bricks[b])) chosen.push_back(b);
  return codec::partOf(layer, chosen);
}

/// Sums over pairs of numbers.
struct ProductSums {
  double count = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;

  void add(double a, double b) {
    count += 1.0, x += a, y += b;
    xx += a * a, xy += a * b, yy += b * b;
  }
};

/// What a sample has in common with the same place of another grid.
class Likeness {
 public:
  Likeness(const SparseVolume& sample, const SparseVolume& other)
      : backgrounds_{other.background, sample.background} {
    for (std::size_t b = 0; b < sample.brickCount(); ++b) addBrick(sample, b, other);
  }

  /// Larger for grids that are more alike: by the changes along z, and by the active voxels.
  [[nodiscard]] double score() const {
    const double norm = steps_.xx * steps_.yy;
    const double alike = norm > 0.0 ? steps_.xy * steps_.xy / norm : 0.0;
    return alike + (inEither_ > 0.0 ? kWeightOfActive * inBoth_ / inEither_ : 0.0);
  }

  /// The maps of values that are tried: none, the best one, and the best one between the
  /// backgrounds.
  [[nodiscard]] std::vector<VoxelReference> maps(std::size_t grid) const {
    std::vector<VoxelReference> maps{{grid}};
    const double spread = values_.count * values_.xx - values_.x * values_.x;
    if (spread > 0.0) {
      const double gain = (values_.count * values_.xy - values_.x * values_.y) / spread;
      add(maps, gain, (values_.y - gain * values_.x) / values_.count);
    }
    if (above_.xx > 0.0) {
      const double gain = above_.xy / above_.xx;
      add(maps, gain, backgrounds_[1] - gain * backgrounds_[0]);
    }
    return maps;
  }

 private:
  static constexpr double kWeightOfActive = 0.5;

  void add(std::vector<VoxelReference>& maps, double gain, double offset) const {
    const VoxelReference map{maps.front().grid, float(gain), float(offset)};
    if (std::isfinite(map.gain) && std::isfinite(map.offset)) maps.push_back(map);
  }

  void addBrick(const SparseVolume& sample, std::size_t b, const SparseVolume& other) {
    const auto at = brickWith(other, sample.brickCorner(b));
    if (!at) {
      inEither_ += sample.active[b].count();
      return;
    }
    const auto x = other.brickValues(*at), y = sample.brickValues(b);
    for (int v = 0; v < kBrickVoxels; ++v) {
      const bool mine = sample.active[b].test(v), others = other.active[*at].test(v);
      inBoth_ += mine && others;
      inEither_ += mine || others;
      if (!mine) continue;
      const auto i = std::size_t(v);
      values_.add(x[i], y[i]);
      above_.add(x[i] - backgrounds_[0], y[i] - backgrounds_[1]);
      if (voxelLocal(v).z > 0) steps_.add(x[i] - x[i - 1], y[i] - y[i - 1]);
    }
  }

  std::array<double, 2> backgrounds_;
  ProductSums values_, above_, steps_;
  double inBoth_ = 0.0, inEither_ = 0.0;
};

struct AlikeGrid {
  VoxelLayer part;
  std::vector<VoxelReference> maps;
  double score = 0.0;
};

/// A reference, the voxels that it names, and the bytes of the sample with it.
struct ReferenceTrial {
  VoxelReference reference;
  const VoxelLayer* of = nullptr;
  std::size_t bytes = std::numeric_limits<std::size_t>::max();
};

std::vector<AlikeGrid> mostAlike(std::span<const StoredGrid> grids, const VoxelLayer& sample,
                                 std::span<const std::size_t> candidates) {
  std::vector<AlikeGrid> found(candidates.size());
  const SparseVolume volume = volumeOf(sample);
  parallelFor(std::size_t{0}, candidates.size(), [&](std::size_t c) {
    const auto& voxels = grids[candidates[c]].voxels;
    if (!voxels) return;
    found[c].part = partNear(*voxels, sample);
    const Likeness likeness(volume, volumeOf(found[c].part));
    found[c].maps = likeness.maps(candidates[c]);
    found[c].score = likeness.score();
  });
  std::erase_if(found, [](const AlikeGrid& candidate) { return candidate.maps.empty(); });
  std::ranges::stable_sort(found, std::ranges::greater(), &AlikeGrid::score);
  found.resize(std::min(found.size(), kMostTried));
  return found;
}

}  // namespace

VoxelReference encode::chooseReference(std::span<const StoredGrid> grids, std::size_t grid,
                                       std::span<const std::size_t> candidates) {
  const VoxelLayer& whole = *grids[grid].voxels;
  const VoxelLayer sample =
      whole.bricks.size() <= kSampleBricks
          ? whole
          : codec::partOf(whole, encode::sampledBricks(whole.bricks, kSampleBricks));
  const auto alike = mostAlike(grids, sample, candidates);
  std::vector<ReferenceTrial> trials(1);
  for (const AlikeGrid& candidate : alike)
    for (const VoxelReference& map : candidate.maps) trials.push_back({map, &candidate.part});
  parallelFor(std::size_t{0}, trials.size(), [&](std::size_t t) {
    if (const auto content = format::putRelated(sample, trials[t].reference, trials[t].of))
      trials[t].bytes = content->size();
  });
  return std::ranges::min_element(trials, {}, &ReferenceTrial::bytes)->reference;
}

StoredGrid encode::expectedFrom(std::span<const StoredGrid> grids, std::size_t grid,
                                const VoxelReference& reference) {
  StoredGrid expected;
  expected.descriptor = grids[grid].descriptor;
  expected.tone = grids[grid].tone;
  expected.farBackground = grids[grid].farBackground;
  expected.field.background = grids[grid].field.background;
  if (!reference.grid) {
    expected.voxels = codec::partOf(*grids[grid].voxels, {});
    return expected;
  }
  VoxelLayer& layer = *(expected.voxels = grids[*reference.grid].voxels);
  const auto mapped = [&](std::int32_t code) {
    const double value = codec::valueOfCode(layer, code);
    return codec::orderOfFloat(float(double(reference.gain) * value + double(reference.offset)));
  };
  std::ranges::transform(layer.codes, layer.codes.begin(), mapped);
  layer.form = VoxelForm::kFloat;
  layer.divisor = 1.0;
  layer.palette.clear();
  return expected;
}

// ---- All grids of a file

namespace {

using encode::GridConverter;

/// Largest number of voxels in bricks of a grid that shares. Coding them once takes about 10 s.
constexpr std::size_t kMostShared = std::size_t{1} << 25;
/// Largest number of voxels in bricks for which voxels are chosen again. It takes about ten times as
/// long as coding them.
constexpr std::size_t kMostChosenAgain = std::size_t{1} << 21;
/// Largest number of voxels in bricks for each byte that they take. Where they take fewer bytes,
/// choosing them again saves little: nothing of the shadow of gas_0004 (328 voxels a byte) in 2.4 CPU seconds.
constexpr std::size_t kMostVoxelsPerByte = 256;

/// Largest number of voxels in bricks of a grid that is coded in the way of related grids where no other grid is like it.
/// It saves some 50 bytes of grids of few voxels.
constexpr std::size_t kMostAlone = std::size_t{1} << 16;
/// Bytes with a reference relative to those without it above which voxels are not chosen again for it.
constexpr double kHopeless = 1.1;

/// Chooses for each grid of voxels another grid of the file that its voxels refer to, where that takes fewer
/// bytes. If the goal is a PSNR or a preset, the voxels are chosen again for this coding.
class Sharing {
 public:
  Sharing(const FileOptions& options, GridConverter& converter, ConvertedFile& made)
      : options_(options), converter_(converter), grids_(made.grids), file_(made.file) {}

  void run() {
    const auto chosen = encode::unlessCancelled([&] { return std::optional(references()); });
    if (!chosen) return;
    references_ = *chosen;
    // A grid comes after the one that it refers to, whose voxels may be chosen again.
    std::vector<std::size_t> round(grids_.size());
    for (std::size_t g = 0; g < round.size(); ++g)
      if (const auto& with = references_[g].grid) round[g] = round[*with] + 1;
    for (std::size_t r = 0; r < round.size(); ++r) {
      std::vector<std::size_t> small, large;
      for (std::size_t g = 0; g < round.size(); ++g)
        if (round[g] == r && mayShare(g)) (isSmall(g) ? small : large).push_back(g);
      encode::forEachAtOnce(small.size(), converter_.mostAtOnce(),
                            [&](std::size_t i) { shareUnlessCancelled(small[i]); });
      for (const std::size_t g : large) shareUnlessCancelled(g);
    }
  }

 private:
  using Shared = GridConversion::Shared;

  /// True if a grid holds voxels of its own that do not take too long to code again.
  [[nodiscard]] bool mayShare(std::size_t g) const {
    const auto& voxels = file_.grids[g].voxels;
    return !grids_[g].twinOf && voxels && voxels->codes.size() <= kMostShared;
  }

  [[nodiscard]] std::vector<std::size_t> candidatesFor(std::size_t g) const {
    std::vector<std::size_t> candidates;
    const auto& transform = file_.grids[g].descriptor.transform;
    for (std::size_t other = 0; other < g; ++other)
      if (mayShare(other) && file_.grids[other].descriptor.transform == transform)
        candidates.push_back(other);
    return candidates;
  }

  /// True if the coding of a grid keeps few threads busy, and takes little memory.
  [[nodiscard]] bool isSmall(std::size_t g) const {
    return file_.grids[g].voxels->codes.size() <= kMostChosenAgain;
  }

  /// The references of all grids, by their voxels before any of them are chosen again.
  [[nodiscard]] std::vector<VoxelReference> references() const {
    std::vector<VoxelReference> found(grids_.size());
    parallelFor(std::size_t{0}, found.size(), [&](std::size_t g) {
      if (mayShare(g)) found[g] = encode::chooseReference(file_.grids, g, candidatesFor(g));
    });
    return found;
  }

  /// A grid whose sharing is cancelled stands alone.
  void shareUnlessCancelled(std::size_t g) {
    try {
      CancelScope::check();
      share(g);
    } catch (const Cancelled&) {
      file_.grids[g] = grids_[g].conversion.grid;
      grids_[g].shared.reset();
    }
  }

  void share(std::size_t g) {
    const VoxelReference& reference = references_[g];
    const bool isAlone = reference == VoxelReference{};
    if (isAlone && file_.grids[g].voxels->codes.size() > kMostAlone) return;
    Shared shared{.bytesWithout = bytesAdded(file_, g)};
    shared.seconds = secondsOf([&] {
      shared.bytesWith = bytesWith(g, reference);
      if (shared.bytesWith >= shared.bytesWithout) file_.grids[g].reference.reset();
      // Each grid of a frame is encoded with the better context.
      if (!options_.previous.file && mayChooseAgain(g, shared)) chooseAgain(g, reference, shared);
    });
    if (!options_.previous.file && file_.grids[g].reference) {
      const auto& with = file_.grids[g].reference->grid;
      if (with) shared.with = grids_[*with].source;
      grids_[g].conversion.grid = file_.grids[g];
      grids_[g].shared = shared;
    }
    copyToTwins(g);
  }

  /// Gives a grid a reference. \return the bytes that it takes with it
  [[nodiscard]] std::uint64_t bytesWith(std::size_t g, const VoxelReference& reference) {
    StoredGrid& grid = file_.grids[g];
    grid.reference = reference;
    format::keepRelated(*grid.voxels, reference,
                        reference.grid ? &*file_.grids[*reference.grid].voxels : nullptr);
    return bytesAdded(file_, g);
  }

  /// True if the voxels of a grid may be others of the same quality.
  [[nodiscard]] bool mayChooseAgain(std::size_t g, const Shared& shared) const {
    const Goal& goal = converter_.goalOf(grids_[g].source);
    const std::size_t voxels = file_.grids[g].voxels->codes.size();
    return (std::holds_alternative<PresetGoal>(goal) || std::holds_alternative<PsnrGoal>(goal)) &&
           double(shared.bytesWith) <= kHopeless * double(shared.bytesWithout) &&
           voxels <= kMostChosenAgain && voxels <= kMostVoxelsPerByte * shared.bytesWithout;
  }

  /// Chooses voxels that take few bytes with a reference, and takes them if they do.
  void chooseAgain(std::size_t g, const VoxelReference& reference, Shared& shared) {
    const StoredGrid expected = encode::expectedFrom(file_.grids, g, reference);
    converter_.step(grids_[g].source, false, [&](const FitOptions& fit) {
      const VolumeGrid source = converter_.read(grids_[g].source);
      StoredGrid again =
          converter_.convert(grids_[g].source, source, &expected, fit).conversion.grid;
      if (!again.voxels) return;
      const StoredGrid before = std::exchange(file_.grids[g], std::move(again));
      const std::uint64_t bytes = bytesWith(g, reference);
      if (bytes >= std::min(shared.bytesWith, shared.bytesWithout)) {
        file_.grids[g] = before;
        return;
      }
      shared.bytesWith = bytes;
      grids_[g].conversion.grid = file_.grids[g];
      converter_.tell(source, grids_[g]);
    });
  }

  /// Gives the twins of a grid its voxels.
  void copyToTwins(std::size_t g) {
    for (std::size_t t = g + 1; t < grids_.size(); ++t) {
      if (grids_[t].twinOf != grids_[g].source) continue;
      const GridDescriptor descriptor = file_.grids[t].descriptor;
      file_.grids[t] = file_.grids[g];
      file_.grids[t].descriptor = descriptor;
      grids_[t].conversion.grid = file_.grids[t];
    }
  }

  const FileOptions& options_;
  GridConverter& converter_;
  std::vector<GridConversion>& grids_;
  EsvrFile& file_;
  std::vector<VoxelReference> references_;
};

}  // namespace

StoredGrid encode::recordAlone(const StoredGrid& grid) {
  StoredGrid record;
  record.descriptor = grid.descriptor;
  record.field.chunks.resize(std::min<std::size_t>(grid.field.chunks.size(), 1));
  record.activeThreshold = grid.activeThreshold;
  record.tone = grid.tone;
  record.activeBox = grid.activeBox;
  record.activeVoxels = grid.activeVoxels;
  record.valueMin = grid.valueMin, record.valueMax = grid.valueMax;
  return record;
}

void encode::shareGrids(const FileOptions& options, GridConverter& converter, ConvertedFile& made) {
  if (!options.shares || made.grids.size() < 2) return;
  Sharing(options, converter, made).run();
  made.file.layout = FileLayout::kCompact;
  made.isShared = true;
}

namespace {

/// Bytes of a section with its row and its padding.
std::uint64_t bytesOfSection(const SectionSummary& section) {
  return kSectionRowBytes + (section.sharedWith ? 0 : format::alignUp(section.storedBytes));
}

}  // namespace

std::uint64_t bytesWithoutSharing(const ConvertedFile& converted, const EsvrSummary& written) {
  std::uint64_t bytes = format::kHeaderBytes;
  bool areJoined = false;
  for (const SectionSummary& section : written.sections) {
    const bool isJoined = section.kind == "grid records";
    areJoined = areJoined || isJoined;
    if (!isJoined && section.kind != "packed sections") bytes += bytesOfSection(section);
  }
  if (areJoined)
    for (const StoredGrid& grid : converted.file.grids)
      bytes += bytesAdded(encode::recordAlone(grid));
  for (const GridConversion& grid : converted.grids)
    if (grid.shared && !grid.twinOf) bytes += grid.shared->bytesWithout - grid.shared->bytesWith;
  return bytes;
}

}  // namespace esvr
