#define ESVR_KERNEL_NAMESPACE avx512
#define ESVR_KERNEL_NAME "avx512"
#include "field/ssim_kernels.inl"
