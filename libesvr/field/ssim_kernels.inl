// The body of ssim_kernels_*.cpp, which compile it for different instruction sets. The compiler
// vectorises the loops over i. No inline function of a library may be called here, for the reason
// in brick_kernels.inl.

#include "field/ssim_kernels.h"
#include "field/ssim_window.h"

namespace esvr::ESVR_KERNEL_NAMESPACE {
namespace {

/// One window sum. The window is symmetric, so two voxels share a multiplication.
inline double sumAt(const double* weights, const double* in, int stride) {
  double sum = weights[kSsimRadius] * in[kSsimRadius * stride];
  for (int tap = 0; tap < kSsimRadius; ++tap)
    sum += weights[tap] * (in[tap * stride] + in[(kSsimTaps - 1 - tap) * stride]);
  return sum;
}

void sumTaps(const double* weights, const double* in, int stride, double* __restrict out,
             int count) {
  for (int i = 0; i < count; ++i) out[i] = sumAt(weights, in + i, stride);
}

void sumRows(const double* weights, const double* in, double* __restrict out, int rows) {
  for (int row = 0; row < rows; ++row, in += kHaloSide, out += kBrickSide)
    for (int i = 0; i < kBrickSide; ++i) out[i] = sumAt(weights, in + i, 1);
}

void multiply(const double* a, const double* b, double* __restrict product, int count) {
  for (int i = 0; i < count; ++i) product[i] = a[i] * b[i];
}

}  // namespace

extern const SsimKernels kSsimKernels;
const SsimKernels kSsimKernels{ESVR_KERNEL_NAME, sumTaps, sumRows, multiply};

}  // namespace esvr::ESVR_KERNEL_NAMESPACE
