#pragma once
/// Ellipsoids and voxels as integers, the forms in which a compact file stores them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
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

// A mask of active voxels that takes fewer bytes than that of a volume and is nearly the same.

/// The overlap (intersection over union) of the active voxels of a source and of its stored grid is
/// above this, unless the grid was told to find active voxels by their values (Activity).
inline constexpr double kMinOverlap = 0.95;

/// Voxels that are active in both masks, and in one of them at least.
struct MaskOverlap {
  std::uint64_t both = 0, either = 0;

  /// Intersection over union; 1 if no voxel is active.
  [[nodiscard]] double iou() const { return either > 0 ? double(both) / double(either) : 1.0; }
  [[nodiscard]] bool suffices() const { return iou() > kMinOverlap; }
};
/// \param a, b  masks of the same bricks
[[nodiscard]] MaskOverlap overlapOf(std::span<const BrickMask> a, std::span<const BrickMask> b);

/// Simplifies the active mask of a volume until hardly more of the overlap may be given up. A voxel
/// changes if the bits that this saves, by the contexts of the voxel coder, are worth more than the
/// voxel; blocks of up to 8^3 voxels are changed together as well. The more a voxel differs from
/// the background, the more it is worth. The active box stays the same, and no voxel outside the
/// volume's bricks becomes active. The result is the same for any number of threads.
/// \param expected  masks of the volume's bricks from which a decoder will predict them, such as those
///                  of the previous frame of a sequence, or nothing
/// \param error  error of the stored values at active voxels (root mean square), above 0. A voxel
///               that differs from the background by this much is worth twice as much as one that
///               does not differ, and one that differs by more than four times as much keeps its
///               state
/// \return masks of the volume's bricks, whose overlap with the volume's suffices()
[[nodiscard]] std::vector<BrickMask> simplifiedMask(const SparseVolume& volume, double error,
                                                    std::span<const BrickMask> expected = {});

/// The simplified masks of a volume, which are made when they are first needed. Any number of
/// threads can ask at the same time.
class SimplifiedMasks {
 public:
  using MakeExpected = std::function<std::vector<BrickMask>()>;

  /// \param volume    must outlive the object
  /// \param expected  makes the expected masks of simplifiedMask() when they are first needed
  /// \param error     the error that the stored grid will have, if it is known before; there is only
  ///                  one mask then
  explicit SimplifiedMasks(const SparseVolume& volume, MakeExpected expected = {},
                           std::optional<double> error = {})
      : volume_(volume), makeExpected_(std::move(expected)), error_(error) {}

  /// The mask for the known error, or else for this one, which is rounded to a power of two. It is kept
  /// as long as the object.
  [[nodiscard]] std::span<const BrickMask> forError(double error) const;

 private:
  const SparseVolume& volume_;
  MakeExpected makeExpected_;
  std::optional<double> error_;
  mutable std::mutex making_;
  mutable std::optional<std::vector<BrickMask>> expected_;
  mutable std::map<int, std::vector<BrickMask>> byExponent_;
};

// A grid's voxels as integer codes, exact or within a bound. A file holds such a layer if voxels
// were chosen instead of ellipsoids (convert.h), or as a residual.

/// The meaning of an integer code n.
enum class VoxelForm {
  kQuantised = 0,  ///< quantised: the value float32(n / divisor), divided in float64
  /// Half floats in increasing order. n >= 0 is the value with the bits n; n < 0 is the negated
  /// value with the bits -1 - n.
  kHalf = 1,
  kFloat = 2,   ///< float32 in the same way
  kPalette = 3  ///< palette entry n
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

  friend bool operator==(const VoxelLayer&, const VoxelLayer&) = default;
};

/// Makes a layer that holds every voxel, the active mask and the background bit for bit. The form
/// is kPalette if there are few distinct values (as in a scaled 8-bit volume), else kHalf if half
/// floats can hold all values, else kFloat.
[[nodiscard]] VoxelLayer exactLayer(const SparseVolume& volume);

/// How a stored grid says which voxels are active. No voxel outside the active bounding box of the
/// source ever becomes active.
enum class Activity {
  /// By value if the overlap with the mask of the source then suffices (MaskOverlap,
  /// quantised.h). Otherwise a simplified mask is stored, with which it does.
  kAuto,
  kNoMask,  ///< as kAuto, but no mask is stored
  kExact,   ///< the exact active mask is stored
  kByValue  ///< a voxel is active if its value differs from the background by more than the bound
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
/// bound, the layer is exactLayer(). With a simplified mask, voxels of the source that differ from
/// the background by more than the bound are active too.
/// \param simplified  the volume's simplified masks for kAuto, if they are kept; null: one is made
/// \param decoded     with kHalfs, the rounded voxels are within the bound, too. The volume's own
///                    active voxels must be halfs.
/// \throws UsageError  the bound is not positive and finite
[[nodiscard]] VoxelLayer boundedLayer(const SparseVolume& volume, double bound, Activity activity,
                                      RoundedSigns signs = RoundedSigns::kMayChange,
                                      const SimplifiedMasks* simplified = nullptr,
                                      DecodedValues decoded = DecodedValues::kFloats);

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
/// \param layer  a layer that boundedLayer made from `volume`; other forms than kQuantised are
///               returned unchanged
[[nodiscard]] ThriftyLayer thriftyLayer(const SparseVolume& volume, VoxelLayer layer,
                                        const ThriftOptions& options);

[[nodiscard]] SparseVolume volumeOf(const VoxelLayer& layer);

/// True if all values that volumeOf() would return are finite, besides the background. Nothing is
/// allocated. The codes must have values.
[[nodiscard]] bool allFinite(const VoxelLayer& layer);

/// Largest absolute difference of two volumes' voxels over the bricks of both, active or not.
[[nodiscard]] double largestDifference(const SparseVolume& a, const SparseVolume& b);

/// Largest absolute difference of a layer's voxels from the volume's.
[[nodiscard]] double largestError(const SparseVolume& volume, const VoxelLayer& layer);

}  // namespace esvr
