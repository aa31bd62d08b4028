#include "vdb2esvr/scene_notes.h"

#include "esvr/container.h"
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

/// Parts of the ellipsoids of a grid that take no raw bytes, so that only their absence is known.
void addUnmeasured(const ConvertedGrid& grid, std::vector<LeftOut>& notes) {
  if (layerCount(grid.stored()) == 1)
    notes.push_back({"importance layers",
                     "there are too few ellipsoids for several layers, or "
                     "the storage has none"});
  if (grid.device == kCpu) notes.push_back({"GPU", "the ellipsoids were fitted on the CPU"});
}

std::vector<LeftOut> partsLeftOut(const RunRecord& record, std::size_t g) {
  const ConvertedGrid& grid = record.grids[g];
  const std::uint64_t ellipsoids = grid.stored().field.ellipsoidCount();
  const auto lacks = [&](const char* kind) { return !hasSection(record.output, g, kind); };

  const ChoiceRecord choice = grid.conversion.choice.value_or(ChoiceRecord{});
  if (grid.stored().voxels && !choice.ellipsoids)
    return {{"ellipsoids", "voxels are stored, exactly or quantised"}};
  if (grid.stored().voxels)
    return {
        {"ellipsoids", "voxels serve the goal better", saved(*choice.voxels, choice.ellipsoids)}};

  std::vector<LeftOut> notes;
  if (choice.voxels)
    notes.push_back(
        {"voxels", "ellipsoids serve the goal better", saved(*choice.ellipsoids, choice.voxels)});
  const bool compact = grid.conversion.compact.has_value();
  if (!grid.conversion.fit.signedIntensities)
    notes.push_back({"signs", "no ellipsoid has a negative intensity",
                     compact ? ellipsoids / kBitsPerByte : 0});
  if (!compact && lacks("rotations"))
    notes.push_back(
        {"rotations", "every ellipsoid is aligned with the axes", ellipsoids * kRotationBytes});
  if (lacks("kappas"))
    notes.push_back(
        {"an edge for each ellipsoid", "all ellipsoids share one kappa", ellipsoids * kFloatBytes});
  if (lacks("chunks")) notes.push_back({"chunk table", "the grid fits in one chunk"});
  if (grid.stored().topology != TopologyKind::kMask)
    notes.push_back({"voxel masks",
                     !lacks("levels") ? "thresholds of blocks determine the active voxels"
                     : lacks("bricks")
                         ? "a threshold determines the active voxels"
                         : "the values determine the active voxels in the stored bricks",
                     grid.bricks * kMaskBytes});
  if (lacks("curve") && !grid.conversion.fit.curve.empty())
    notes.push_back({"curve", "files with a wanted size or PSNR do not store it; the report has it",
                     grid.conversion.fit.curve.size() * sizeof(TimedCurvePoint)});
  addUnmeasured(grid, notes);
  return notes;
}

}  // namespace

std::vector<LeftOut> leftOut(const RunRecord& record, std::size_t g) {
  std::vector<LeftOut> notes = partsLeftOut(record, g);
  for (auto& note : decisionNotes(record.grids[g].conversion)) notes.push_back(std::move(note));
  return notes;
}

}  // namespace esvr::vdb2esvr
