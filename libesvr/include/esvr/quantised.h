#pragma once
/// Ellipsoids and voxels as integers, the forms in which a compact file stores them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/volume.h"

namespace esvr {

// Ellipsoids as integers on a quantisation lattice. A compact file stores each chunk in this form.
//
// Ellipsoids need different precisions, since the effect of an error grows with the ellipsoid's
// weight w = |I| sqrt(sum phi^2). Each ellipsoid therefore has a precision e, the octave of its
// weight. The number of bits of a parameter follows from e and from the parameters that are
// decoded earlier: rotations depend on the ratios of the scales, positions on the scales and the
// rotation, intensities on the ellipsoid's volume. The numbers of bits are computed from integers
// only. The values are computed with +, -, *, / and sqrt in float64 and rounded once to float32,
// so they are bit-identical on every machine (docs/format.md, "The quantisation lattice").

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

// A grid's voxels as integer codes, exact or within a bound. A file holds such a layer if voxels
// were chosen instead of ellipsoids (encode.h), or as a residual.

/// The meaning of an integer code n.
enum class VoxelForm {
  kQuantised = 0,  ///< quantised: the value float32(n / divisor), divided in float64
  /// Half floats in increasing order. n >= 0 is the value with the bits n; n < 0 is the negated
  /// value with the bits -1 - n.
  kHalf = 1,
  kFloat = 2,   ///< float32 in the same way
  kPalette = 3  ///< palette entry n
};

/// The section of a file that holds a voxel layer, kept so that the layer is coded once. It counts only
/// while the layer is the same, which its checksum shows, and layers are compared without it.
struct CodedVoxels {
  std::uint64_t checksum = 0;                             ///< checksum of the layer that was coded
  std::shared_ptr<const std::vector<std::byte>> section;  ///< null: not coded yet

  friend bool operator==(const CodedVoxels&, const CodedVoxels&) { return true; }
};

struct VoxelLayer {
  VoxelForm form = VoxelForm::kFloat;
  double divisor = 1.0;            ///< divisor of kQuantised
  std::vector<float> palette;      ///< values of kPalette, in the order of kFloat
  Coord origin;                    ///< see SparseVolume
  float background = 0.0f;         ///< exact background
  std::vector<Coord> bricks;       ///< see SparseVolume
  VoxelArray<std::int32_t> codes;  ///< kBrickVoxels per brick; vacant voxels have the background's
  std::vector<BrickMask> active;
  std::vector<BrickMask> vacant;  ///< inactive voxels that are exactly the background
  CodedVoxels coded;
  CodedVoxels
      related;  ///< with another grid as context (VoxelReference), which the checksum includes

  friend bool operator==(const VoxelLayer&, const VoxelLayer&) = default;
};

/// Makes a layer that holds every voxel, the active mask and the background bit for bit. The form
/// is kPalette if there are few distinct values (as in a scaled 8-bit volume), else kHalf if half
/// floats can hold all values, else kFloat.
[[nodiscard]] VoxelLayer exactLayer(const SparseVolume& volume);

/// The same, without a palette where it would take more bytes than it saves.
[[nodiscard]] VoxelLayer smallestExactLayer(const SparseVolume& volume);

/// How a stored grid says which voxels are active. Either way, the active bounding box stays that of the
/// source: no voxel outside it becomes active, and each of its faces keeps an active voxel.
enum class Activity {
  /// A voxel is active if its value differs from the background by more than the error of the grid. No
  /// mask is stored.
  kByValue,
  kExact  ///< the exact active mask is stored
};

/// Whether rounding keeps the signs of values. The surface of a level set is where they change.
enum class RoundedSigns {
  kMayChange,  ///< values are rounded to the nearest code
  /// A negative value never becomes 0, and no other value becomes negative. The quantisation steps
  /// are half as wide as without it, so that the values nearest to 0 keep the bound, too.
  kKept
};

/// The numbers that a reader of a grid gets (ValueType, grid.h).
enum class DecodedValues {
  kFloats,
  kHalfs  ///< active voxels are rounded by roundToHalfs() after everything else
};

/// Rounds active voxels to the nearest half floats, as decodeGrid() does for a grid whose source was
/// saved as half. Values beyond 65504 become 65504 with their sign, and no negative value becomes 0.
void roundToHalfs(SparseVolume& volume);

/// Makes a layer whose voxels are within `bound` of the volume's. If float32 is too coarse for the
/// bound, the layer is exactLayer(). With Activity::kByValue, the voxels that differ from the background
/// by no more than the bound become inactive and get the background, but for the few that keep the
/// active box (boxVoxels, volume.h).
/// \param decoded  with kHalfs, the rounded voxels are within the bound, too. The volume's own active
///                 voxels must be halfs.
/// \throws UsageError  the bound is not positive and finite
[[nodiscard]] VoxelLayer boundedLayer(const SparseVolume& volume, double bound, Activity activity,
                                      RoundedSigns signs = RoundedSigns::kMayChange,
                                      DecodedValues decoded = DecodedValues::kFloats);

/// The nearest codes on the lattice of a bound, as boundedLayer() makes them first. Nothing is decoded, so that an error
/// may exceed the bound by what values lose in float32.
/// \throws UsageError  as boundedLayer()
[[nodiscard]] VoxelLayer nearestLayer(const SparseVolume& volume, double bound, Activity activity,
                                      RoundedSigns signs = RoundedSigns::kMayChange);

/// What thriftyLayer() weighs. All errors are in squared steps of the quantisation lattice.
struct ThriftOptions {
  /// Squared error that may be added to save a bit. By the theory of fine quantisation it is
  /// ln(2) / 6 = 0.1155 (6.02 dB for each bit); with much larger values, the predictions of later
  /// voxels become worse.
  double bitPrice = 0.0;
  /// The layer of the previous frame of a sequence. The bits are those of a frame that is predicted
  /// from it (grid_coding.h). Null: those of a volume of its own.
  const VoxelLayer* previous = nullptr;
  /// Share of the errors of the previous frame that the voxels keep, from 0 to 1. The errors are
  /// estimated from the difference between neighbours. It is ignored without `previous`.
  double steadiness = 0.0;
  /// With kKept, no code gets another sign (negative or not) than the voxel has in the volume.
  RoundedSigns signs = RoundedSigns::kMayChange;
  /// Price of the square of the sum of the errors of a brick's voxels, relative to that of the square of
  /// one error. Without it, faint voxels become 0 one by one, and a brick loses what they add up to. It is
  /// ignored with `previous`.
  double massPrice = 0.0;
  /// Bytes of the codes above which the work stops. It is ignored with `previous`.
  std::uint64_t mostBytes = std::numeric_limits<std::uint64_t>::max();
};

struct ThriftyLayer {
  VoxelLayer layer;
  /// Set if the codes take more than ThriftOptions::mostBytes: the bytes of all codes, extrapolated
  /// from those that were chosen. The layer is incomplete then and should not be used.
  std::optional<std::uint64_t> tooMany{};
};

/// Makes a layer smaller by rate-distortion optimised quantisation. A voxel gets a code at most
/// two steps away that takes fewer bits, if its squared error grows by less than the saved bits
/// times the price of a bit. The error of a voxel is then at most 2.5 steps of the quantisation
/// lattice, and errors are correlated with the coder's predictions. Vacant voxels remain vacant.
/// \param layer  a layer that nearestLayer() or boundedLayer() made from `volume`; other forms than kQuantised are
///               returned unchanged
[[nodiscard]] ThriftyLayer thriftyLayer(const SparseVolume& volume, VoxelLayer layer,
                                        const ThriftOptions& options);

[[nodiscard]] SparseVolume volumeOf(const VoxelLayer& layer);

/// True if all values that volumeOf() would return are finite, besides the background. Nothing is
/// allocated. The codes must have values.
[[nodiscard]] bool allFinite(const VoxelLayer& layer);

/// Largest absolute difference of two volumes' voxels over the bricks of both, active or not.
[[nodiscard]] double largestDifference(const SparseVolume& a, const SparseVolume& b);

}  // namespace esvr
