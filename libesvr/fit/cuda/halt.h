#pragma once
/// Kernels that do nothing once the lists of pairs are outgrown (fit/motion_bound.h). The host
/// starts several steps ahead; the step that finds an ellipsoid outside its listed support halts
/// those after it, which the host starts again when it has built new lists.

#include "esvr/kernel.h"

namespace esvr::cuda {

/// \param flag  in device memory; null: never halted
ESVR_HD inline bool isHalted(const int* flag) { return flag != nullptr && *flag != 0; }

}  // namespace esvr::cuda
