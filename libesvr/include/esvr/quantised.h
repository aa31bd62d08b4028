#pragma once
/// Ellipsoids as integers on a lattice: what a compact file stores of a chunk.
///
/// Not every ellipsoid needs its parameters to the same digit: what an error costs grows with the
/// ellipsoid's weight w = |I| sqrt(sum phi^2). Each has a precision e, an octave of w, and every
/// parameter gets as many bits as e and the scales, which are known by then, ask for: positions
/// follow the smallest scale, rotations the ratio of the scales, intensities the volume. The
/// numbers of bits are computed from integers alone, the values from them by +, -, *, / and sqrt in
/// float64 and one rounding to float32: the same bits on every machine (docs/format.md, "The
/// lattice").

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"

namespace esvr {

/// The lattice of one chunk. All bits of a parameter are counted from its coarsest step.
struct Lattice {
  static constexpr int kMaxPrecision = 15;
  static constexpr int kMaxCellBits = 20;
  static constexpr int kMaxPositionBits = 22;  ///< bits of cell and place in it: float32 holds them
  static constexpr int kMaxRotationBits = 14;
  static constexpr int kMaxScaleBits = 16;
  static constexpr int kMaxIntensityShift = 24;
  static constexpr std::uint32_t kMaxCoarseScale = 4095;
  static constexpr std::uint32_t kMaxIntensity = (1u << 22) - 1;

  double cell = 1.0;  ///< side of the cells that centers are sorted by, voxels
  Coord lowestCell;   ///< cells count from here
  int cellBits = 0;   ///< bits of a cell's number along an axis
  int positionBase = 0, positionSlope = 0;    ///< 1/256 bit; slope by a coarse step of the scale
  double scaleStep = 1.0;                     ///< coarse step of the logarithm of a scale
  std::int32_t lowestScale = 0;               ///< smallest logarithm, in coarse steps
  int scaleOffset = 0;                        ///< precision at which the coarse step is enough
  int rotationOffset = 0;                     ///< bits at precision 0 and equal scales
  std::vector<std::uint8_t> rotationFrom;     ///< ratio, in coarse steps, from which one bit more
  double intensityStep = 1.0;                 ///< step for ellipsoids of the smallest volume
  int intensityBase = 0, intensitySlope = 0;  ///< 1/256 octave; slope by a coarse step of a scale
  bool signedIntensity = false;

  friend bool operator==(const Lattice&, const Lattice&) = default;
};

/// n ellipsoids in the order of the file: layer by layer, the heaviest first, each by Morton order
/// of its cells.
struct QuantisedEllipsoids {
  Lattice lattice;
  std::array<std::vector<std::uint32_t>, 3> position;  ///< (cell << bits) + place in the cell
  std::vector<std::uint8_t> precision;                 ///< e
  /// Logarithms of the smallest scale above the lowest, of the middle one above it, of the largest
  /// above that: (coarse << bits) + rest.
  std::array<std::vector<std::uint32_t>, 3> scale;
  std::array<std::vector<std::uint16_t>, 3> rotation;  ///< x, y, z of the quaternion
  std::vector<std::int32_t> intensity;                 ///< magnitude m as m, negative as -1 - m
  /// The ends of the importance layers, increasing, the last of two or more at size(). Empty: one
  /// layer.
  std::vector<std::size_t> layerEnds;

  [[nodiscard]] std::size_t size() const { return precision.size(); }
  void resize(std::size_t n);
  friend bool operator==(const QuantisedEllipsoids&, const QuantisedEllipsoids&) = default;
};

/// The error that a step may cost: that of V, as root of the sum of squares over voxels, that half
/// a step's rounding leaves behind on average is about 0.29 times this, in the grid's values.
struct QuantiserSteps {
  double position = 0.0, scale = 0.0, rotation = 0.0, intensity = 0.0;
};

/// The lattice for an error, and the precisions of ellipsoids.
struct LatticeChoice {
  Lattice lattice;
  std::vector<std::uint8_t> precision;
  /// Lowest precision of every layer but the last, decreasing; empty where there are too few
  /// ellipsoids to tell apart. A layer is made of octaves of the weight: since precisions are
  /// stored anyway, knowing the layer saves in them what it costs in the positions.
  std::vector<std::uint8_t> layerFrom{};
};

/// \param phi2  sum over voxels of phi^2, for each ellipsoid (intensityCurvature)
/// \throws RuntimeFailure  centers or scales that no lattice of so many bits holds
[[nodiscard]] LatticeChoice chooseLattice(const Ellipsoids& e, std::span<const double> phi2,
                                          const QuantiserSteps& steps);

/// Rounds. Axes are sorted, so that scales decrease; ellipsoids as the file has them.
/// \param order  out: the ellipsoids' indices in `e`, in the file's order
/// \throws RuntimeFailure  values outside the lattice
[[nodiscard]] QuantisedEllipsoids quantise(const Ellipsoids& e, const LatticeChoice& choice,
                                           std::vector<std::size_t>& order);

/// Rounds intensities anew, on the lattice that the scales have. \param intensities  file order
void quantiseIntensities(std::span<const float> intensities, QuantisedEllipsoids& q);

/// The ellipsoids that the integers stand for. Exact: the same bits everywhere.
[[nodiscard]] Ellipsoids dequantise(const QuantisedEllipsoids& q);

}  // namespace esvr
