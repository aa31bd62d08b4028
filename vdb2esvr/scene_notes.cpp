#include "vdb2esvr/scene_notes.h"

#include "esvr/container.h"
#include "vdb2esvr/decision_notes.h"

namespace esvr::vdb2esvr {
namespace {

constexpr const char* kCpu = "CPU";  // deviceName()

/// Lists what the ellipsoids of a grid do without.
class EllipsoidNotes {
 public:
  EllipsoidNotes(const RunRecord& record, std::size_t g)
      : record_(record), g_(g), grid_(record.grids[g]) {}

  std::vector<LeftOut> list() {
    addParameters();
    addActivity();
    addStorage();
    return std::move(notes_);
  }

 private:
  [[nodiscard]] bool lacks(const char* kind) const { return !hasSection(record_.output, g_, kind); }
  void add(const char* part, const char* why) { notes_.push_back({part, why}); }

  void addParameters() {
    if (!grid_.conversion.fit.signedIntensities)
      add("signs", "no ellipsoid has a negative intensity");
    if (!grid_.conversion.compact && lacks("rotations"))
      add("rotations", "every ellipsoid is aligned with the axes");
    if (lacks("kappas")) add("an edge for each ellipsoid", "all ellipsoids share one kappa");
  }

  void addActivity() {
    if (grid_.stored().topology != TopologyKind::kMask) add("voxel masks", ruleOfActivity());
    if (grid_.stored().topology != TopologyKind::kBlocks)
      add("thresholds of blocks", "one rule determines all active voxels");
  }

  [[nodiscard]] const char* ruleOfActivity() const {
    if (!lacks("levels")) return "thresholds of blocks determine the active voxels";
    if (lacks("bricks")) return "a threshold determines the active voxels";
    return "the values determine the active voxels in the stored bricks";
  }

  void addStorage() {
    if (lacks("chunks")) add("chunk table", "the grid fits in one chunk");
    if (layerCount(grid_.stored()) == 1)
      add("importance layers",
          "there are too few ellipsoids for several layers, or the storage has none");
    if (lacks("curve") && !grid_.conversion.fit.curve.empty())
      add("curve", "files with a wanted size or PSNR do not store it; the report has it");
    if (grid_.device == kCpu) add("GPU", "the ellipsoids were fitted on the CPU");
  }

  const RunRecord& record_;
  std::size_t g_;
  const ConvertedGrid& grid_;
  std::vector<LeftOut> notes_;
};

std::vector<LeftOut> partsLeftOut(const RunRecord& record, std::size_t g) {
  const Conversion& conversion = record.grids[g].conversion;
  const ChoiceRecord choice = conversion.choice.value_or(ChoiceRecord{});
  if (conversion.grid.voxels)
    return {{"ellipsoids", choice.ellipsoids ? "voxels serve the goal better"
                                             : "voxels are stored, exactly or quantised"}};
  std::vector<LeftOut> notes = EllipsoidNotes(record, g).list();
  if (choice.voxels) notes.insert(notes.begin(), {"voxels", "ellipsoids serve the goal better"});
  return notes;
}

}  // namespace

std::vector<LeftOut> leftOut(const RunRecord& record, std::size_t g) {
  std::vector<LeftOut> notes = partsLeftOut(record, g);
  for (auto& note : decisionNotes(record.grids[g].conversion)) notes.push_back(std::move(note));
  return notes;
}

}  // namespace esvr::vdb2esvr
