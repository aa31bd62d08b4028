#include "vdb2esvr/share.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "esvr/encode.h"
#include "esvr/error.h"
#include "programs/run_main.h"

namespace esvr::vdb2esvr {
namespace {

/// Largest number of voxels in bricks of a grid that shares. Coding them once takes about 10 s.
constexpr std::size_t kMostShared = std::size_t{1} << 25;
/// Largest number of voxels in bricks for which voxels are chosen again. It takes about ten times as
/// long as coding them.
constexpr std::size_t kMostChosenAgain = std::size_t{1} << 21;
/// Largest number of voxels in bricks for each byte that they take. Where they take fewer bytes,
/// choosing them again saves little.
constexpr std::size_t kMostVoxelsPerByte = 512;

/// The grids of a file while they are being shared.
class Sharing {
 public:
  Sharing(const Options& options, const std::vector<FittedGrid>& fitted, EsvrFile& file,
          RunRecord& record)
      : options_(options), fitted_(fitted), file_(file), record_(record) {}

  void run() {
    for (std::size_t g = 0; g < record_.grids.size() && !isCancelled(); ++g)
      if (mayShare(g)) shareUnlessCancelled(g);
  }

 private:
  [[nodiscard]] bool isCancelled() const { return options_.convert.fit.cancel->cancelled(); }

  [[nodiscard]] ConvertedGrid& converted(std::size_t g) const { return record_.grids[g]; }

  /// True if a grid holds voxels of its own that do not take too long to code again.
  [[nodiscard]] bool mayShare(std::size_t g) const {
    const auto& voxels = file_.grids[g].voxels;
    return !record_.grids[g].twinOf && voxels && voxels->codes.size() <= kMostShared;
  }

  [[nodiscard]] std::vector<std::size_t> candidatesFor(std::size_t g) const {
    std::vector<std::size_t> candidates;
    const auto& transform = file_.grids[g].descriptor.transform;
    for (std::size_t other = 0; other < g; ++other)
      if (mayShare(other) && file_.grids[other].descriptor.transform == transform)
        candidates.push_back(other);
    return candidates;
  }

  /// A grid whose sharing is cancelled stands alone.
  void shareUnlessCancelled(std::size_t g) {
    try {
      CancelScope::check();
      share(g);
    } catch (const Cancelled&) {
      file_.grids[g] = converted(g).stored();
      converted(g).shared.reset();
    }
  }

  void share(std::size_t g) {
    cli::Stopwatch watch;
    SharedBytes shared{.bytesWithout = bytesAdded(file_, g)};
    const VoxelReference reference = chooseReference(file_.grids, g, candidatesFor(g));
    file_.grids[g].reference = reference;
    shared.bytesWith = bytesAdded(file_, g);
    if (shared.bytesWith >= shared.bytesWithout) file_.grids[g].reference.reset();
    if (options_.previous) return copyToTwins(g);  // each grid is encoded with the better context
    chooseAgain(g, reference, shared);
    shared.seconds = watch.lap();
    if (!file_.grids[g].reference) return;
    if (reference.grid) shared.with = converted(*reference.grid).uniqueName;
    converted(g).conversion.grid = file_.grids[g];
    converted(g).shared = shared;
    copyToTwins(g);
  }

  /// True if the voxels of a grid may be others of the same quality.
  [[nodiscard]] bool mayChooseAgain(std::size_t g, const SharedBytes& shared) const {
    const Goal& goal = goalOf(options_, fittedOf(g));
    const std::size_t voxels = file_.grids[g].voxels->codes.size();
    return (std::holds_alternative<PresetGoal>(goal) || std::holds_alternative<PsnrGoal>(goal)) &&
           voxels <= kMostChosenAgain && voxels <= kMostVoxelsPerByte * shared.bytesWithout;
  }

  /// Chooses voxels that take few bytes with a reference, and takes them if they do.
  void chooseAgain(std::size_t g, const VoxelReference& reference, SharedBytes& shared) {
    if (!mayChooseAgain(g, shared)) return;
    ConvertedGrid again = convertedAgain(g, reference);
    if (!again.stored().voxels) return;
    StoredGrid before = std::exchange(file_.grids[g], again.stored());
    file_.grids[g].reference = reference;
    const std::uint64_t bytes = bytesAdded(file_, g);
    if (bytes >= std::min(shared.bytesWith, shared.bytesWithout)) {
      file_.grids[g] = std::move(before);
      return;
    }
    shared.bytesWith = bytes;
    converted(g).metrics = again.metrics;
    converted(g).surface = again.surface;
  }

  [[nodiscard]] ConvertedGrid convertedAgain(std::size_t g, const VoxelReference& reference) const {
    const StoredGrid expected = expectedFrom(file_.grids, g, reference);
    Options options = options_;
    options.convert.keepsPastErrors = false;  // those of another grid are not worth keeping
    return convertGrid(options, fittedOf(g), std::nullopt, &expected);
  }

  [[nodiscard]] const FittedGrid& fittedOf(std::size_t g) const {
    return *std::ranges::find(fitted_, converted(g).id, &FittedGrid::id);
  }

  /// Gives the twins of a grid its voxels.
  void copyToTwins(std::size_t g) {
    for (std::size_t t = g + 1; t < record_.grids.size(); ++t) {
      if (converted(t).twinOf != converted(g).id) continue;
      const GridDescriptor descriptor = file_.grids[t].descriptor;
      file_.grids[t] = file_.grids[g];
      file_.grids[t].descriptor = descriptor;
      converted(t).conversion.grid = file_.grids[t];
      converted(t).metrics = converted(g).metrics;
      converted(t).surface = converted(g).surface;
    }
  }

  const Options& options_;
  const std::vector<FittedGrid>& fitted_;
  EsvrFile& file_;
  RunRecord& record_;
};

constexpr std::uint64_t kHeaderBytes = 48, kAlignment = 8;  // docs/format.md

/// Bytes of a section with its row and its padding.
std::uint64_t bytesOfSection(const SectionSummary& section) {
  const std::uint64_t padded = (section.storedBytes + kAlignment - 1) / kAlignment * kAlignment;
  return kSectionRowBytes + (section.sharedWith ? 0 : padded);
}

/// Bytes that the record of a grid adds.
std::uint64_t bytesOfRecord(const StoredGrid& grid) {
  StoredGrid record;
  record.descriptor = grid.descriptor;
  record.field.chunks.resize(std::min<std::size_t>(grid.field.chunks.size(), 1));
  record.activeThreshold = grid.activeThreshold;
  record.tone = grid.tone;
  record.activeBox = grid.activeBox;
  record.activeVoxels = grid.activeVoxels;
  record.valueMin = grid.valueMin, record.valueMax = grid.valueMax;
  return bytesAdded(record);
}

}  // namespace

std::uint64_t bytesWithoutSharing(const EsvrFile& file, const RunRecord& record) {
  std::uint64_t bytes = kHeaderBytes;
  bool areJoined = false;
  for (const SectionSummary& section : record.output.sections) {
    const bool isJoined = section.kind == "grid records";
    areJoined = areJoined || isJoined;
    if (!isJoined && section.kind != "packed sections") bytes += bytesOfSection(section);
  }
  if (areJoined)
    for (const StoredGrid& grid : file.grids) bytes += bytesOfRecord(grid);
  for (const ConvertedGrid& grid : record.grids)
    if (grid.shared && !grid.twinOf) bytes += grid.shared->bytesWithout - grid.shared->bytesWith;
  return bytes;
}

void shareGrids(const Options& options, const std::vector<FittedGrid>& fitted, EsvrFile& file,
                RunRecord& record) {
  // The bytes of a wanted size are divided among grids that are stored on their own.
  const bool isSized = options.size || options.ratio;
  if (!options.shares || isSized || record.grids.size() < 2) return;
  Sharing(options, fitted, file, record).run();
  file.layout = FileLayout::kCompact;
}

}  // namespace esvr::vdb2esvr
