#define ESVR_KERNEL_NAMESPACE avx512
#define ESVR_KERNEL_NAME "avx512"
#define ESVR_KERNEL_LANES 16
#define ESVR_KERNEL_NATIVE 16
#include "field/brick_kernels.inl"
