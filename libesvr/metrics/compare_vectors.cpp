#include "esvr/vector_metrics.h"

namespace esvr {

double peakOfVectors(const VectorVolume& reference) { return peakOf(magnitudeOf(reference)); }

VectorMetrics compareVectors(const VectorVolume& reference, const VectorVolume& candidate,
                             const CompareOptions& options) {
  const VectorVolume a = aligned(reference), b = aligned(candidate);
  const SparseVolume lengths = magnitudeOf(a);
  CompareOptions same = options;
  if (!same.peak) same.peak = peakOf(lengths);
  VectorMetrics metrics{compareVolumes(lengths, magnitudeOf(b), same), {}};
  for (std::size_t c = 0; c < kComponents; ++c)
    metrics.components[c] = compareVolumes(a[c], b[c], same);
  return metrics;
}

}  // namespace esvr
