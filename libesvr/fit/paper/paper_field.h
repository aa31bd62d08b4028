#pragma once
/// Converts the paper's ellipsoids to a Field.

#include "esvr/ellipsoids.h"
#include "fit/export_field.h"
#include "fit/paper/paper_ellipsoid.h"

namespace esvr::paper {

/// \param frame  a frame whose kernel and kappas are replaced by those of `kind`
[[nodiscard]] Field fieldOf(const Population& population, const KernelKind& kind,
                            ExportFrame frame);

/// Drops ellipsoids that contribute to no voxel of a box.
void dropUnseen(Population& population, const KernelKind& kind, const Box& box);

}  // namespace esvr::paper
