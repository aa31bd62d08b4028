#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <compare>
#include <numbers>
#include <string>
#include <utility>

#include "codec/lattice_bits.h"
#include "codec/morton.h"
#include "codec/sorted_axes.h"
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

void putCenter(const std::array<double, 3>& cells, std::size_t i, int bits,
               QuantisedEllipsoids& q) {
  for (std::size_t a = 0; a < 3; ++a)
    q.position[a][i] = codeOf(cells[a], bits, (1u << q.lattice.cellBits) - 1, "a center");
}

void putRotation(const std::array<double, 4>& r, std::size_t i, int bits, QuantisedEllipsoids& q) {
  const double last = std::ldexp(1.0, bits) - 1.0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double code = std::floor(std::ldexp(r[a + 1] / kRotationSide + 0.5, bits));
    q.rotation[a][i] = std::uint16_t(std::clamp(code, 0.0, last));
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

std::uint64_t keyOf(const Ellipsoids& e, std::size_t i, const Lattice& lattice) {
  const auto cells = cellsOf(e, i, lattice);
  std::uint64_t key = 0;
  for (std::size_t a = 0; a < 3; ++a)
    key |= spreadBits(codeOf(cells[a], 0, (1u << lattice.cellBits) - 1, "a center")) << a;
  return key;
}

/// The number of an ellipsoid's layer, counted from the layer of the largest weights.
std::size_t layerOf(const LatticeChoice& choice, std::size_t i) {
  return std::size_t(std::count_if(choice.layerFrom.begin(), choice.layerFrom.end(),
                                   [&](auto from) { return choice.precision[i] < from; }));
}

std::vector<std::size_t> fileOrder(const Ellipsoids& e, const LatticeChoice& choice) {
  struct Place {
    std::size_t layer;
    std::uint64_t key;
    std::size_t ellipsoid;  // decides between equal keys
    auto operator<=>(const Place&) const = default;
  };
  std::vector<Place> places(e.size());
  tbb::parallel_for(Range(0, e.size(), kEllipsoidsPerTask), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      places[i] = {layerOf(choice, i), keyOf(e, i, choice.lattice), i};
  });
  tbb::parallel_sort(places.begin(), places.end());
  std::vector<std::size_t> order(e.size());
  for (std::size_t i = 0; i < e.size(); ++i) order[i] = places[i].ellipsoid;
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

/// Quantises ellipsoid `from` to place i, where its precision is already set.
void put(const Ellipsoids& e, std::size_t from, std::size_t i, QuantisedEllipsoids& q) {
  const SortedAxes axes = sortedAxes(e, from);
  putScales(axes.logScale, i, q);
  const CoarseScales s = coarseScales(q, i);
  putCenter(cellsOf(e, from, q.lattice), i, positionBits(q.lattice, q.precision[i], s), q);
  putRotation(axes.rotation, i, rotationBits(q.lattice, q.precision[i], s), q);
  putIntensity(e.intensity[from], i, q);
}

}  // namespace

QuantisedEllipsoids quantise(const Ellipsoids& e, const LatticeChoice& choice,
                             std::vector<std::size_t>& order) {
  QuantisedEllipsoids q;
  q.lattice = choice.lattice;
  q.resize(e.size());
  order = fileOrder(e, choice);
  q.layerEnds = layerEnds(choice, order);
  tbb::parallel_for(Range(0, order.size(), kEllipsoidsPerTask), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      q.precision[i] = choice.precision[order[i]];
      put(e, order[i], i, q);
    }
  });
  return q;
}

void quantiseIntensities(std::span<const float> intensities, QuantisedEllipsoids& q) {
  tbb::parallel_for(Range(0, q.size(), kEllipsoidsPerTask), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) putIntensity(intensities[i], i, q);
  });
}

}  // namespace esvr
