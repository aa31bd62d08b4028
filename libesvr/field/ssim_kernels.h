#pragma once
/// The inner loops over SSIM windows. They are compiled once for each instruction set and chosen at
/// run time.

#include <vector>

namespace esvr {

struct SsimKernels {
  const char* name;
  /// Computes out[i] = sum over t of weights[t] * in[i + t * stride] for i from 0 to count - 1,
  /// with the kSsimTaps weights of a symmetric window. `in` and `out` must not overlap.
  void (*sumTaps)(const double* weights, const double* in, int stride, double* out, int count);
  /// Does the same along rows of kHaloSide values, whose results are rows of kBrickSide values.
  void (*sumRows)(const double* weights, const double* in, double* out, int rows);
  void (*multiply)(const double* a, const double* b, double* product, int count);
};

/// The kernels for the best instruction set of this processor.
[[nodiscard]] const SsimKernels& ssimKernels();

/// The kernels for all instruction sets that this processor has, the best first.
[[nodiscard]] std::vector<const SsimKernels*> runnableSsimKernels();

}  // namespace esvr
