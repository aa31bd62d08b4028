// What the grids of a file share: voxels that refer to those of another grid, and the bytes that this saves.
#include <algorithm>
#include <utility>
#include <variant>

#include "core/add_seconds.h"
#include "core/parallel.h"
#include "encode/grids_of_file.h"
#include "encode/job.h"
#include "esvr/error.h"

namespace esvr {
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
      if (mayShare(g)) found[g] = chooseReference(file_.grids, g, candidatesFor(g));
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
      file_.grids[g].reference = reference;
      shared.bytesWith = bytesAdded(file_, g);
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
    const StoredGrid expected = expectedFrom(file_.grids, g, reference);
    converter_.step(grids_[g].source, false, [&](const FitOptions& fit) {
      const VolumeGrid source = converter_.read(grids_[g].source);
      StoredGrid again = converter_.convert(grids_[g].source, source, {.expected = &expected}, fit)
                             .conversion.grid;
      if (!again.voxels) return;
      const StoredGrid before = std::exchange(file_.grids[g], std::move(again));
      file_.grids[g].reference = reference;
      const std::uint64_t bytes = bytesAdded(file_, g);
      if (bytes >= std::min(shared.bytesWith, shared.bytesWithout)) {
        file_.grids[g] = before;
        return;
      }
      shared.bytesWith = bytes;
      grids_[g].conversion.grid = file_.grids[g];
      if (options_.onConverted) options_.onConverted(source, grids_[g]);
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
  // The bytes of a wanted size are divided among grids that are stored on their own.
  if (!options.shares || options.size || made.grids.size() < 2) return;
  Sharing(options, converter, made).run();
  made.file.layout = FileLayout::kCompact;
  made.isShared = true;
}

namespace {

constexpr std::uint64_t kHeaderBytes = 48, kAlignment = 8;  // docs/format.md

/// Bytes of a section with its row and its padding.
std::uint64_t bytesOfSection(const SectionSummary& section) {
  const std::uint64_t padded = (section.storedBytes + kAlignment - 1) / kAlignment * kAlignment;
  return kSectionRowBytes + (section.sharedWith ? 0 : padded);
}

}  // namespace

std::uint64_t bytesWithoutSharing(const ConvertedFile& converted, const EsvrSummary& written) {
  std::uint64_t bytes = kHeaderBytes;
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
