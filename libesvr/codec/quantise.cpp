#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <compare>
#include <numbers>
#include <string>
#include <utility>

#include "codec/lattice_bits.h"
#include "codec/morton.h"
#include "codec/rounding.h"
#include "codec/sorted_axes.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/quantised.h"

namespace esvr {
namespace {

using Range = tbb::blocked_range<std::size_t>;

/// The code of a value in coarse steps, each of which is divided into 2^bits codes.
/// \throws RuntimeFailure  the value has no code
std::uint32_t codeOf(double steps, int bits, std::uint32_t lastCoarse, const char* what) {
  const double code = std::floor(std::ldexp(std::max(steps, 0.0), bits));
  if (!(code < std::ldexp(double(lastCoarse) + 1.0, bits)))
    throw RuntimeFailure(std::string("cannot quantise: ") + what + " lies outside the lattice");
  return std::uint32_t(code);
}

/// Codes the scales. Each logarithm is coded as the difference from the decoded value of the next
/// smaller scale, so that rounding errors do not add up.
void putScales(const std::array<double, 3>& logScale, std::size_t i, QuantisedEllipsoids& q) {
  const int bits = scaleBits(q.lattice, q.precision[i]);
  double below = double(q.lattice.lowestScale);
  for (std::size_t a = 0; a < 3; ++a) {
    const double steps = logScale[2 - a] / q.lattice.scaleStep;
    q.scale[a][i] = codeOf(steps - below, bits, Lattice::kMaxCoarseScale, "a scale");
    below += std::ldexp(double(q.scale[a][i]) + 0.5, -bits);
  }
}

std::array<double, 3> cellsOf(const Ellipsoids& e, std::size_t i, const Lattice& lattice) {
  const Coord& low = lattice.lowestCell;
  return {e.center[0][i] / lattice.cell - low.x, e.center[1][i] / lattice.cell - low.y,
          e.center[2][i] / lattice.cell - low.z};
}

/// Rounds the coordinates one after the other (rounding.h).
void putCenter(const std::array<double, 3>& cells, const CoupledErrors& errors,
               const AxisBits& bits, std::size_t i, QuantisedEllipsoids& q) {
  const std::uint32_t lastCell = (1u << q.lattice.cellBits) - 1;
  std::array<double, 3> error{};
  for (std::size_t a = 0; a < 3; ++a) {
    (void)codeOf(cells[a], bits[a], lastCell, "a center");
    const double last = std::ldexp(double(lastCell) + 1.0, bits[a]) - 1.0;
    const double code = std::floor(std::ldexp(cells[a] + errors.shift(a, error), bits[a]));
    q.position[a][i] = std::uint32_t(std::clamp(code, 0.0, last));
    error[a] = std::ldexp(double(q.position[a][i]) + 0.5, -bits[a]) - cells[a];
  }
}

/// The code of a rotation's component without limits, in units of the last bit.
double rotationCode(double component) {
  return std::ldexp(component / kRotationSide + 0.5, Lattice::kMaxRotationBits);
}

/// Sets the coarse bits of a rotation; the others are 0.
void putCoarseRotation(const SortedAxes& axes, std::size_t i, int bits, QuantisedEllipsoids& q) {
  const double step = std::ldexp(1.0, Lattice::kMaxRotationBits - bits);
  const double last = std::ldexp(1.0, bits) - 1.0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double code = std::floor(rotationCode(axes.rotation[a + 1]) / step);
    q.rotation[a][i] = std::uint16_t(std::clamp(code, 0.0, last) * step);
  }
}

/// Rounds the components one after the other (rounding.h). Their coarse bits remain.
void putRotation(const SortedAxes& axes, std::size_t i, QuantisedEllipsoids& q) {
  const CoarseScales s = coarseScales(q, i);
  const int coarse = coarseRotationBits(q.lattice, q.precision[i], s);
  putCoarseRotation(axes, i, coarse, q);
  const AxisBits bits = rotationBits(q.lattice, q.precision[i], s, rotationCodes(q, i));
  const CoupledErrors errors = rotationErrors(axes);
  std::array<double, 3> error{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double step = std::ldexp(1.0, Lattice::kMaxRotationBits - bits[a]);
    const double first = double(q.rotation[a][i]) / step;
    const double last = first + std::ldexp(1.0, bits[a] - coarse) - 1.0;
    const double exact = rotationCode(axes.rotation[a + 1]);
    const double code = std::floor((exact + errors.shift(a, error)) / step);
    q.rotation[a][i] = std::uint16_t(std::clamp(code, first, last) * step);
    error[a] = double(q.rotation[a][i]) + 0.5 * step - exact;
  }
}

void putIntensity(double intensity, std::size_t i, QuantisedEllipsoids& q) {
  const int shift = intensityShift(q.lattice, coarseScales(q, i));
  const bool negative = q.lattice.signedIntensity && intensity < 0.0;
  const double magnitude =
      (negative || intensity > 0.0 ? std::abs(intensity) : 0.0) / q.lattice.intensityStep;
  const double code = std::floor(std::ldexp(magnitude, shift));
  const auto clamped = std::int32_t(std::min(code, double(Lattice::kMaxIntensity)));
  q.intensity[i] = negative ? -1 - clamped : clamped;
}

std::uint64_t keyOf(const QuantisedEllipsoids& q, std::size_t i) {
  const AxisBits bits = shapeBits(q, i).position;
  std::uint64_t key = 0;
  for (std::size_t a = 0; a < 3; ++a) key |= spreadBits(q.position[a][i] >> bits[a]) << a;
  return key;
}

/// The number of an ellipsoid's layer, counted from the layer of the largest weights.
std::size_t layerOf(const LatticeChoice& choice, std::size_t i) {
  return std::size_t(std::count_if(choice.layerFrom.begin(), choice.layerFrom.end(),
                                   [&](auto from) { return choice.precision[i] < from; }));
}

std::vector<std::size_t> fileOrder(const QuantisedEllipsoids& q, const LatticeChoice& choice) {
  struct Place {
    std::size_t layer;
    std::uint64_t key;
    std::size_t ellipsoid;  // decides between equal keys
    auto operator<=>(const Place&) const = default;
  };
  std::vector<Place> places(q.size());
  parallelFor(Range(0, q.size(), kEllipsoidsPerTask), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      places[i] = {layerOf(choice, i), keyOf(q, i), i};
  });
  tbb::parallel_sort(places.begin(), places.end());
  std::vector<std::size_t> order(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) order[i] = places[i].ellipsoid;
  return order;
}

/// \param order  the ellipsoids in their new order, layer by layer
std::vector<std::size_t> layerEnds(const LatticeChoice& choice,
                                   const std::vector<std::size_t>& order) {
  std::vector<std::size_t> ends;
  for (std::size_t i = 1; i < order.size(); ++i)
    if (layerOf(choice, order[i]) != layerOf(choice, order[i - 1])) ends.push_back(i);
  if (!ends.empty()) ends.push_back(order.size());
  return ends;
}

/// Quantises ellipsoid i, whose precision is already set.
void put(const Ellipsoids& e, std::size_t i, QuantisedEllipsoids& q) {
  const SortedAxes axes = sortedAxes(e, i);
  putScales(axes.logScale, i, q);
  putRotation(axes, i, q);
  putCenter(cellsOf(e, i, q.lattice), centerErrors(axes), shapeBits(q, i).position, i, q);
  putIntensity(e.intensity[i], i, q);
}

template <class T>
void permute(const std::vector<std::size_t>& order, std::vector<T>& values) {
  std::vector<T> permuted(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) permuted[i] = values[order[i]];
  values = std::move(permuted);
}

void permute(const std::vector<std::size_t>& order, QuantisedEllipsoids& q) {
  for (auto* planes : {&q.position, &q.scale})
    for (auto& plane : *planes) permute(order, plane);
  for (auto& plane : q.rotation) permute(order, plane);
  permute(order, q.precision);
  permute(order, q.intensity);
}

}  // namespace

QuantisedEllipsoids quantise(const Ellipsoids& e, const LatticeChoice& choice,
                             std::vector<std::size_t>& order) {
  QuantisedEllipsoids q;
  q.lattice = choice.lattice;
  q.resize(e.size());
  q.precision = choice.precision;
  parallelFor(Range(0, e.size(), kEllipsoidsPerTask), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) put(e, i, q);
  });
  order = fileOrder(q, choice);
  q.layerEnds = layerEnds(choice, order);
  permute(order, q);
  return q;
}

void quantiseIntensities(std::span<const float> intensities, QuantisedEllipsoids& q) {
  parallelFor(Range(0, q.size(), kEllipsoidsPerTask), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) putIntensity(intensities[i], i, q);
  });
}

}  // namespace esvr
