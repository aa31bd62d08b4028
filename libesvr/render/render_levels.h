#pragma once
/// Draws pictures of a volume whose coarser levels are kept from picture to picture.

#include "esvr/render.h"
#include "render/voxel_levels.h"

namespace esvr {

/// Draws as renderVolume, with the same exceptions.
[[nodiscard]] Image renderLevels(VolumeLevels& levels, const RenderOptions& options);

}  // namespace esvr
