#pragma once
/// From the paper's ellipsoids to what files store.

#include "esvr/ellipsoids.h"
#include "fit/export_field.h"
#include "fit/paper/paper_ellipsoid.h"

namespace esvr::paper {

/// \param frame  its kernel and kappas are those of `kind`
[[nodiscard]] Field fieldOf(const Population& population, const KernelKind& kind,
                            ExportFrame frame);

/// Drops ellipsoids that no voxel of a box sees. They cost bytes and change nothing.
void dropUnseen(Population& population, const KernelKind& kind, const Box& box);

}  // namespace esvr::paper
