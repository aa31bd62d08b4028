#include "vdb2esvr/decision_notes.h"

namespace esvr::vdb2esvr {
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

}  // namespace

std::vector<LeftOut> decisionNotes(const Conversion& conversion) {
  const DecisionRecord& decisions = conversion.decisions;
  return {clampNote(conversion), note("plateau", whyPlateau(conversion), decisions.plateau),
          representationNote(conversion)};
}

}  // namespace esvr::vdb2esvr
