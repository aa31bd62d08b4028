#define ESVR_KERNEL_NAMESPACE avx2
#define ESVR_KERNEL_NAME "avx2"
#define ESVR_KERNEL_LANES 8
#define ESVR_KERNEL_NATIVE 8
#include "field/brick_kernels.inl"
