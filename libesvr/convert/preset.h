#pragma once
/// Converts a volume with the quality of a preset.

#include <functional>

#include "convert/attempt.h"

namespace esvr::convert {

/// See PresetGoal.
/// \param fit  the conversion of a FitGoal, for volumes that are too large for a search, unless the
///             goal is steady
[[nodiscard]] Conversion convertToPreset(const Job& job, const PresetGoal& goal,
                                         const std::function<Conversion()>& fit);

}  // namespace esvr::convert
