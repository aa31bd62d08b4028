// The parts that a written file does without, and what the conversion decided about means of making
// it smaller.
#include "vdb2esvr/left_out.h"

#include "esvr/container.h"

namespace esvr::vdb2esvr {

// Decisions, which are listed also where the file has their part.

namespace {

bool hasEllipsoids(const Conversion& conversion) {
  return conversion.grid.field.ellipsoidCount() > 0;
}

LeftOut note(const char* part, const char* why, const Decision& decision) {
  LeftOut made{part, why};
  made.used = decision.used;
  made.bytesWith = decision.bytesWith;
  made.bytesWithout = decision.bytesWithout;
  made.seconds = decision.seconds;
  return made;
}

const char* whyClamp(const Conversion& conversion) {
  if (!hasEllipsoids(conversion)) return "voxels are stored, which need no clamp";
  if (!conversion.grid.withinRange)
    return "the sum of a narrow band is not clamped; one byte of the grid record says so";
  if (conversion.decisions.bothSigns.used)
    return "the sum is clamped to the range of the values, as one byte of the grid record says; "
           "intensities have both signs, because short fits showed that this is better";
  if (conversion.decisions.bothSigns.tried)
    return "the sum is clamped to the range of the values, as one byte of the grid record says; "
           "intensities have the signs of the values, because short fits showed no gain by both";
  return "the sum is clamped to the range of the values, as one byte of the grid record says";
}

/// The clamp itself takes no time and no bytes besides its flag. What takes time is to find out
/// whether intensities of both signs, which it makes possible, are better.
LeftOut clampNote(const Conversion& conversion) {
  Decision decision;
  decision.used = hasEllipsoids(conversion) && conversion.grid.withinRange;
  decision.seconds = conversion.decisions.bothSigns.seconds;
  return note("clamp", whyClamp(conversion), decision);
}

const char* whyPlateau(const Conversion& conversion) {
  const Decision& plateau = conversion.decisions.plateau;
  if (plateau.used) return "a lattice that contains the most frequent value serves the goal better";
  if (plateau.tried && !conversion.grid.voxels)
    return "ellipsoids are stored, which have no lattice of values";
  if (plateau.tried) return "a lattice that contains the most frequent value was no better";
  if (plateau.seconds) return "no value is frequent enough, or the voxels are small without it";
  return "no lattice of voxels was chosen for the goal";
}

const Candidate& storedOf(const ChoiceRecord& choice, bool voxels) {
  return voxels ? *choice.voxels : *choice.ellipsoids;
}

/// The choice between two candidates. An estimated size was not measured, so it is left out.
LeftOut chosen(const ChoiceRecord& choice, bool voxels) {
  const Candidate& stored = storedOf(choice, voxels);
  const Candidate& other = storedOf(choice, !voxels);
  Decision decision{.tried = true, .used = true, .seconds = other.seconds};
  if (!stored.estimated) decision.bytesWith = stored.bytes;
  if (!other.estimated) decision.bytesWithout = other.bytes;
  return note("representation",
              voxels ? "voxels serve the goal better than ellipsoids"
                     : "ellipsoids serve the goal better than voxels",
              decision);
}

LeftOut representationNote(const Conversion& conversion) {
  const ChoiceRecord choice = conversion.choice.value_or(ChoiceRecord{});
  if (choice.voxels && choice.ellipsoids) return chosen(choice, conversion.grid.voxels.has_value());
  if (conversion.smallerExactBytes)
    return note("representation", "an option determines it; exact voxels would take fewer bytes",
                {});
  const char* why = choice.voxels || choice.ellipsoids
                        ? "the other representation was not tried or cannot reach the goal"
                        : "the goal, an option or the size of the volume determines it";
  return note("representation", why, {});
}

std::vector<LeftOut> decisionNotes(const Conversion& conversion) {
  const DecisionRecord& decisions = conversion.decisions;
  return {clampNote(conversion), note("plateau", whyPlateau(conversion), decisions.plateau),
          representationNote(conversion)};
}

// Parts.

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
  }

  [[nodiscard]] const char* ruleOfActivity() const {
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
