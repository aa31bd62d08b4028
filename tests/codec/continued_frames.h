#pragma once
/// Frames of random ellipsoids for the tests of ellipsoids that continue those of the previous frame.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "../field/random_field.h"
#include "codec/continued_coder.h"
#include "esvr/quantised.h"

namespace esvr::test {

/// A frame without a previous one.
inline QuantisedEllipsoids firstFrame(std::size_t count, bool bothSigns = false,
                                      std::uint64_t seed = 3) {
  Ellipsoids e =
      randomField({.count = count, .extent = 50.0, .smallest = 0.7, .aspect = 6.0, .seed = seed})
          .chunks[0]
          .ellipsoids;
  if (!bothSigns)
    for (float& intensity : e.intensity) intensity = std::abs(intensity);
  std::vector<double> phi2(count);  // of Gaussians
  for (std::size_t i = 0; i < count; ++i)
    phi2[i] = 1.97 * std::exp(double(e.logScale[0][i]) + e.logScale[1][i] + e.logScale[2][i]);
  LatticeChoice choice = chooseLattice(e, phi2, {0.05, 0.05, 0.05, 0.05});
  choice.layerFrom.clear();
  std::vector<std::size_t> order;
  return quantise(e, choice, order);
}

inline std::vector<std::uint32_t> allOf(const QuantisedEllipsoids& before) {
  std::vector<std::uint32_t> all(before.size());
  std::iota(all.begin(), all.end(), 0u);
  return all;
}

/// All ellipsoids but one in `period`.
inline std::vector<std::uint32_t> mostOf(const QuantisedEllipsoids& before, std::uint32_t period) {
  std::vector<std::uint32_t> most = allOf(before);
  std::erase_if(most, [&](std::uint32_t i) { return i % period == 1; });
  return most;
}

/// The lattice of the previous frame with twice as many cells, which begin elsewhere.
inline Lattice withMovedCells(Lattice lattice) {
  lattice.lowestCell = lattice.lowestCell - Coord{3, 1, 2};
  ++lattice.cellBits;
  return lattice;
}

/// How ellipsoids change from frame to frame. All but the drift are random, up to this size.
struct Change {
  double motion = 0.3;  ///< voxels
  double drift = 0.0;   ///< voxels along x
  double scale = 0.05;  ///< of logarithms
  double turn = 0.02;   ///< of the components of a quaternion
  double value = 0.05;  ///< of logarithms of intensities
  std::uint64_t seed = 1;
};

/// A coordinate that is moved, but stays within the cells of a lattice.
inline float movedWithin(const Lattice& lattice, std::int32_t lowest, double coordinate) {
  const double low = double(lowest) * lattice.cell;
  const double side = std::ldexp(lattice.cell, lattice.cellBits);
  return float(std::clamp(coordinate, low + 1e-3, low + side - 1e-3));
}

/// The exact ellipsoids that continue some of the previous frame.
inline Ellipsoids movedFrom(const QuantisedEllipsoids& before,
                            const std::vector<std::uint32_t>& continues, const Change& change) {
  const Ellipsoids old = dequantise(before);
  const std::int32_t lowest[] = {before.lattice.lowestCell.x, before.lattice.lowestCell.y,
                                 before.lattice.lowestCell.z};
  Random random(change.seed);
  Ellipsoids e;
  e.resize(continues.size());
  for (std::size_t i = 0; i < e.size(); ++i) {
    const std::size_t p = continues[i];
    double q[4], norm = 0.0;
    for (std::size_t a = 0; a < 4; ++a)
      q[a] = old.rotation[a][p] + random(-change.turn, change.turn), norm += q[a] * q[a];
    for (std::size_t a = 0; a < 4; ++a) e.rotation[a][i] = float(q[a] / std::sqrt(norm));
    for (std::size_t a = 0; a < 3; ++a) {
      const double moved =
          old.center[a][p] + random(-change.motion, change.motion) + (a == 0 ? change.drift : 0.0);
      e.center[a][i] = movedWithin(before.lattice, lowest[a], moved);
      // Scales grow by at least a little, so that none falls below the lattice.
      e.logScale[a][i] = old.logScale[a][p] + float(random(0.0, change.scale));
    }
    e.intensity[i] = old.intensity[p] * float(std::exp(random(-change.value, change.value)));
  }
  return e;
}

/// Quantises ellipsoids without sorting them.
inline QuantisedEllipsoids quantisedInOrder(const Ellipsoids& e, const LatticeChoice& choice) {
  std::vector<std::size_t> order;
  const QuantisedEllipsoids q = quantise(e, choice, order);
  QuantisedEllipsoids result = q;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t i = order[k];
    for (std::size_t a = 0; a < 3; ++a) {
      result.position[a][i] = q.position[a][k];
      result.scale[a][i] = q.scale[a][k];
      result.rotation[a][i] = q.rotation[a][k];
    }
    result.precision[i] = q.precision[k];
    result.intensity[i] = q.intensity[k];
  }
  return result;
}

/// A frame whose ellipsoids continue some of the previous one, each rounded to the nearest codes.
inline QuantisedEllipsoids frameAfter(const QuantisedEllipsoids& before,
                                      const std::vector<std::uint32_t>& continues,
                                      const Change& change, const Lattice& lattice) {
  LatticeChoice choice{lattice, {}};
  for (const std::uint32_t p : continues) choice.precision.push_back(before.precision[p]);
  QuantisedEllipsoids now = quantisedInOrder(movedFrom(before, continues, change), choice);
  now.continues = continues;
  return now;
}

inline QuantisedEllipsoids frameAfter(const QuantisedEllipsoids& before,
                                      const std::vector<std::uint32_t>& continues,
                                      const Change& change = {}) {
  return frameAfter(before, continues, change, before.lattice);
}

}  // namespace esvr::test
