#pragma once
/// The inner loops over windows, compiled once per instruction set and chosen at run time.

#include <vector>

namespace esvr {

struct SsimKernels {
  const char* name;
  /// out[i] = sum over taps t of weights[t] * in[i + t * stride], for the kSsimTaps weights of a
  /// symmetric window. in and out do not overlap.
  void (*sumTaps)(const double* weights, const double* in, int stride, double* out, int count);
  /// The same along rows of kHaloSide values to rows of kBrickSide.
  void (*sumRows)(const double* weights, const double* in, double* out, int rows);
  void (*multiply)(const double* a, const double* b, double* product, int count);
};

/// The best set this processor runs.
[[nodiscard]] const SsimKernels& ssimKernels();

/// All sets this processor runs, the best first.
[[nodiscard]] std::vector<const SsimKernels*> runnableSsimKernels();

}  // namespace esvr
