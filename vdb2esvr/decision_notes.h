#pragma once
/// Lists what a conversion decided about three means of making a grid smaller, also where the file
/// has them: the clamp, the plateau and the choice of the representation.

#include <vector>

#include "esvr/convert.h"
#include "vdb2esvr/scene_notes.h"

namespace esvr::vdb2esvr {

[[nodiscard]] std::vector<LeftOut> decisionNotes(const Conversion& conversion);

}  // namespace esvr::vdb2esvr
