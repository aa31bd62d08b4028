#pragma once
/// Eigen's fixed-size matrices, for host and device.

#if defined(__CUDACC__)
// Eigen annotates defaulted members, which nvcc warns about.
#pragma nv_diagnostic push
#pragma nv_diag_suppress 20012
#endif
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#if defined(__CUDACC__)
#pragma nv_diagnostic pop
#endif
