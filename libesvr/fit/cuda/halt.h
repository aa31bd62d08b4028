#pragma once
/// A flag that makes kernels do nothing once the pair lists are outdated (fit/motion_bound.h). The
/// host starts several steps ahead. The step at which the lists end sets the flag of the steps
/// after it; the host starts these again after it has built new lists.

#include "esvr/kernel.h"

namespace esvr::cuda {

/// \param flag  flag in device memory; null: never halted
ESVR_HD inline bool isHalted(const int* flag) { return flag != nullptr && *flag != 0; }

}  // namespace esvr::cuda
