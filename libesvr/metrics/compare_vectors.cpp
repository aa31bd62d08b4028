#include <algorithm>

#include "esvr/vector_metrics.h"

namespace esvr {
namespace {

double peakOfLengths(const SparseVolume& lengths) {
  const double longest = activeRange(lengths).max;
  return longest > 0.0 ? longest : 1.0;
}

}  // namespace

double peakOfVectors(const VectorVolume& reference) {
  return peakOfLengths(magnitudeOf(reference));
}

double valueRangeOfVectors(const VectorVolume& reference) {
  double largest = 0.0;
  for (const SparseVolume& component : aligned(reference))
    largest = std::max(largest, valueRangeOf(component));
  return largest;
}

VectorMetrics compareVectors(const VectorVolume& reference, const VectorVolume& candidate,
                             const CompareOptions& options) {
  const VectorVolume a = aligned(reference), b = aligned(candidate);
  const SparseVolume lengths = magnitudeOf(a);
  CompareOptions same = options;
  if (!same.peak) same.peak = peakOfLengths(lengths);
  VectorMetrics metrics{compareVolumes(lengths, magnitudeOf(b), same), {}};
  for (std::size_t c = 0; c < kComponents; ++c)
    metrics.components[c] = compareVolumes(a[c], b[c], same);
  return metrics;
}

}  // namespace esvr
