#pragma once
/// Ellipsoids as integers on a quantisation lattice. A compact file stores each chunk in this form.
///
/// Ellipsoids need different precisions, since the effect of an error grows with the ellipsoid's
/// weight w = |I| sqrt(sum phi^2). Each ellipsoid therefore has a precision e, the octave of its
/// weight. The number of bits of a parameter follows from e and from the parameters that are
/// decoded earlier: rotations depend on the ratios of the scales, positions on the scales and the
/// rotation, intensities on the ellipsoid's volume. The numbers of bits are computed from integers
/// only. The values are computed with +, -, *, / and sqrt in float64 and rounded once to float32,
/// so they are bit-identical on every machine (docs/format.md, "The quantisation lattice").

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"

namespace esvr {

/// The quantisation lattice of one chunk. The bits of a parameter are counted from its coarsest
/// step.
struct Lattice {
  static constexpr int kMaxPrecision = 15;
  static constexpr int kMaxCellBits = 20;
  static constexpr int kMaxPositionBits = 22;  ///< bits of a cell and of the place in it together
  static constexpr int kMaxRotationBits = 14;
  static constexpr int kMaxScaleBits = 16;
  static constexpr int kMaxIntensityShift = 24;
  static constexpr std::uint32_t kMaxCoarseScale = 4095;
  static constexpr std::uint32_t kMaxIntensity = (1u << 22) - 1;

  double cell = 1.0;  ///< side of the cells by which centers are sorted, voxels
  Coord lowestCell;   ///< cell with the coordinates 0
  int cellBits = 0;   ///< bits of a cell's coordinate along one axis
  int positionBase = 0, positionSlope = 0;    ///< 1/256 bit; slope for each coarse step of scale
  double scaleStep = 1.0;                     ///< coarse step of a scale's logarithm
  std::int32_t lowestScale = 0;               ///< smallest logarithm, in coarse steps
  int scaleOffset = 0;                        ///< precision for which coarse steps suffice
  int rotationOffset = 0;                     ///< bits at precision 0 and equal scales
  std::vector<std::uint8_t> rotationFrom;     ///< ratios, in coarse steps, that add one bit each
  double intensityStep = 1.0;                 ///< step at the smallest volume
  int intensityBase = 0, intensitySlope = 0;  ///< 1/256 octave; slope for each coarse step of scale
  bool signedIntensity = false;

  friend bool operator==(const Lattice&, const Lattice&) = default;
};

/// n ellipsoids in the order of the file: the importance layers follow each other, that of the
/// largest weights first, and each layer is in Morton order of its cells.
struct QuantisedEllipsoids {
  Lattice lattice;
  std::array<std::vector<std::uint32_t>, 3> position;  ///< (cell << bits) + place in the cell
  std::vector<std::uint8_t> precision;                 ///< precision e of each ellipsoid
  /// Differences of logarithms: smallest scale less `lowestScale`, middle scale less smallest,
  /// largest less middle. Each is (coarse << bits) + rest.
  std::array<std::vector<std::uint32_t>, 3> scale;
  /// x, y, z of the quaternion, in units of 2^-kMaxRotationBits of their interval. Bits that a
  /// component does not have are 0.
  std::array<std::vector<std::uint16_t>, 3> rotation;
  std::vector<std::int32_t> intensity;  ///< m for +m, -1 - m for -m
  /// End index of each importance layer, increasing; the last one is size(). Empty: there is one
  /// layer only.
  std::vector<std::size_t> layerEnds;

  [[nodiscard]] std::size_t size() const { return precision.size(); }
  void resize(std::size_t n);
  friend bool operator==(const QuantisedEllipsoids&, const QuantisedEllipsoids&) = default;
};

/// Quantisation steps of the four parameter streams, in terms of the error that they cause in V:
/// the root of the sum of squares over voxels, in value units. A uniform rounding error has a
/// standard deviation of 0.29 steps.
struct QuantiserSteps {
  double position = 0.0, scale = 0.0, rotation = 0.0, intensity = 0.0;
};

/// A quantisation lattice and the precisions of the ellipsoids on it.
struct LatticeChoice {
  Lattice lattice;
  std::vector<std::uint8_t> precision;
  /// Lowest precision of every layer but the last, decreasing; empty if there are too few
  /// ellipsoids for several layers. A layer consists of whole octaves of the weight: the precisions
  /// are then cheaper to code, which pays for the additional bits of the positions.
  std::vector<std::uint8_t> layerFrom{};
};

/// Chooses the quantisation lattice for given quantisation steps.
/// \param phi2  sum over voxels of phi^2 for each ellipsoid
/// \throws RuntimeFailure  the centers or scales need more bits than a lattice can have
[[nodiscard]] LatticeChoice chooseLattice(const Ellipsoids& e, std::span<const double> phi2,
                                          const QuantiserSteps& steps);

/// Rounds ellipsoids to a quantisation lattice and sorts them into the file's order. The axes of
/// each ellipsoid are sorted, so that its scales decrease.
/// \param order  output: the ellipsoids' indices in `e`, in the file's order
/// \throws RuntimeFailure  a value lies outside the lattice
[[nodiscard]] QuantisedEllipsoids quantise(const Ellipsoids& e, const LatticeChoice& choice,
                                           std::vector<std::size_t>& order);

/// Replaces the intensities by new ones, rounded to the existing quantisation lattice.
/// \param intensities  one for each ellipsoid, in the file's order
void quantiseIntensities(std::span<const float> intensities, QuantisedEllipsoids& q);

/// The ellipsoids that the integers represent, bit-identical on every machine.
[[nodiscard]] Ellipsoids dequantise(const QuantisedEllipsoids& q);

}  // namespace esvr
