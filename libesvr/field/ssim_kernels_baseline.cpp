#define ESVR_KERNEL_NAMESPACE baseline
#define ESVR_KERNEL_NAME "baseline"
#include "field/ssim_kernels.inl"
