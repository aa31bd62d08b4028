#include "vdb2esvr/scene_notes.h"

#include "esvr/container.h"
#include "esvr/forced_part.h"
#include "esvr/grid_coding.h"
#include "vdb2esvr/decision_notes.h"

namespace esvr::vdb2esvr {
namespace {

constexpr std::uint64_t kFloatBytes = sizeof(float);
constexpr std::uint64_t kRotationBytes = 4 * kFloatBytes;
constexpr std::uint64_t kBitsPerByte = 8;
constexpr std::uint64_t kMaskBytes = sizeof(BrickMask);

/// Bytes by which a candidate is smaller than another; 0 if it is not.
std::uint64_t saved(const Candidate& taken, const std::optional<Candidate>& other) {
  return other && other->bytes > taken.bytes ? other->bytes - taken.bytes : 0;
}

constexpr const char* kCpu = "CPU";  // deviceName()

/// The largest grid whose parts are measured, in voxels of its bricks. Beyond it, measuring takes
/// seconds.
constexpr std::uint64_t kMostMeasuredVoxels = std::uint64_t{1} << 24;

/// Measures what the parts of a grid would cost.
class PartCosts {
 public:
  explicit PartCosts(const ConvertedGrid& grid) : grid_(grid.stored()) {
    if (grid.bricks * kBrickVoxels <= kMostMeasuredVoxels) decoded_ = decodeGrid(grid_);
  }

  [[nodiscard]] LeftOut measured(LeftOut note, Part part) const {
    if (!decoded_) return note;
    if (const auto bytes = bytesWithPart(grid_, part, *decoded_)) {
      note.bytesWith = bytes->with;
      note.bytesWithout = bytes->without;
    }
    return note;
  }

 private:
  const StoredGrid& grid_;
  std::optional<SparseVolume> decoded_;
};

/// Lists what the ellipsoids of a grid do without.
class EllipsoidNotes {
 public:
  EllipsoidNotes(const RunRecord& record, std::size_t g)
      : record_(record), g_(g), grid_(record.grids[g]), costs_(grid_) {}

  std::vector<LeftOut> list() {
    addParameters();
    addActivity();
    addStorage();
    return std::move(notes_);
  }

 private:
  [[nodiscard]] bool lacks(const char* kind) const { return !hasSection(record_.output, g_, kind); }
  void add(Part part, LeftOut note) { notes_.push_back(costs_.measured(std::move(note), part)); }

  void addParameters() {
    const std::uint64_t ellipsoids = grid_.stored().field.ellipsoidCount();
    const bool compact = grid_.conversion.compact.has_value();
    if (!grid_.conversion.fit.signedIntensities)
      add(Part::kSigns, {"signs", "no ellipsoid has a negative intensity",
                         compact ? ellipsoids / kBitsPerByte : 0});
    if (!compact && lacks("rotations"))
      add(Part::kRotations,
          {"rotations", "every ellipsoid is aligned with the axes", ellipsoids * kRotationBytes});
    if (lacks("kappas"))
      add(Part::kKappas, {"an edge for each ellipsoid", "all ellipsoids share one kappa",
                          ellipsoids * kFloatBytes});
  }

  void addActivity() {
    if (grid_.stored().topology != TopologyKind::kMask)
      add(Part::kMask, {"voxel masks", ruleOfActivity(), grid_.bricks * kMaskBytes});
    if (grid_.stored().topology != TopologyKind::kBlocks)
      add(Part::kLevels, {"thresholds of blocks", "one rule determines all active voxels"});
  }

  [[nodiscard]] const char* ruleOfActivity() const {
    if (!lacks("levels")) return "thresholds of blocks determine the active voxels";
    if (lacks("bricks")) return "a threshold determines the active voxels";
    return "the values determine the active voxels in the stored bricks";
  }

  void addStorage() {
    if (lacks("chunks")) add(Part::kChunks, {"chunk table", "the grid fits in one chunk"});
    if (layerCount(grid_.stored()) == 1)
      add(Part::kLayers,
          {"importance layers",
           "there are too few ellipsoids for several layers, or the storage has none"});
    const auto& curve = grid_.conversion.fit.curve;
    if (lacks("curve") && !curve.empty())
      notes_.push_back({"curve",
                        "files with a wanted size or PSNR do not store it; the report has it",
                        curve.size() * sizeof(TimedCurvePoint)});
    if (grid_.device == kCpu) notes_.push_back({"GPU", "the ellipsoids were fitted on the CPU"});
  }

  const RunRecord& record_;
  std::size_t g_;
  const ConvertedGrid& grid_;
  PartCosts costs_;
  std::vector<LeftOut> notes_;
};

std::vector<LeftOut> partsLeftOut(const RunRecord& record, std::size_t g) {
  const ConvertedGrid& grid = record.grids[g];
  const ChoiceRecord choice = grid.conversion.choice.value_or(ChoiceRecord{});
  if (grid.stored().voxels && !choice.ellipsoids)
    return {{"ellipsoids", "voxels are stored, exactly or quantised"}};
  if (grid.stored().voxels)
    return {
        {"ellipsoids", "voxels serve the goal better", saved(*choice.voxels, choice.ellipsoids)}};
  std::vector<LeftOut> notes = EllipsoidNotes(record, g).list();
  if (choice.voxels)
    notes.insert(notes.begin(), {"voxels", "ellipsoids serve the goal better",
                                 saved(*choice.ellipsoids, choice.voxels)});
  return notes;
}

}  // namespace

std::vector<LeftOut> leftOut(const RunRecord& record, std::size_t g) {
  std::vector<LeftOut> notes = partsLeftOut(record, g);
  for (auto& note : decisionNotes(record.grids[g].conversion)) notes.push_back(std::move(note));
  return notes;
}

}  // namespace esvr::vdb2esvr
