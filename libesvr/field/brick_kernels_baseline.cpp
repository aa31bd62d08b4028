#define ESVR_KERNEL_NAMESPACE baseline
#define ESVR_KERNEL_NAME "baseline"
#define ESVR_KERNEL_LANES 8
#define ESVR_KERNEL_NATIVE 4
#include "field/brick_kernels.inl"
