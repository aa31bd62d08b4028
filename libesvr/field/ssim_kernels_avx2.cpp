#define ESVR_KERNEL_NAMESPACE avx2
#define ESVR_KERNEL_NAME "avx2"
#include "field/ssim_kernels.inl"
