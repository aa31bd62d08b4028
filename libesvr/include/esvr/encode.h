#pragma once
/// The encoder: converts a volume to a stored grid for a goal, and leaves the less important ellipsoids of a grid out.
/// vdb2esvr and esvr-compare call it for every grid.
///
/// A goal states a condition for the stored grid. A conversion makes at most two whole fits to reach it
/// (three for Preset::kHigh and above the usual effort; four of at most half the length where ellipsoids take
/// less than 2 KB; for a size up to five, until one keeps to it), and at most six short ones, which forecast
/// them, besides two that choose a tone curve. For Preset::kHigh, one of the short ones is continued for a sixth of the
/// iterations of a whole one.

#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/fit.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "esvr/paper_method.h"
#include "esvr/quantised.h"
#include "esvr/tone.h"
#include "esvr/volume.h"

namespace esvr {

/// A single fit, which ends as FitOptions determine.
struct FitGoal {
  friend auto operator<=>(const FitGoal&, const FitGoal&) = default;
};

/// The smallest grid found with the quality that FitOptions::preset stands for (PresetQuality): picturePsnr if the
/// measure is what is seen, surfaceBound for a level set that is no narrow band (isNarrowBand, grid_coding.h), and
/// otherwise an error of at most that of psnr over the active voxels.
/// Errors at inactive voxels of the box count too, so that the PSNR over the active voxels alone is at least
/// as high. FitOptions::count, psnr and seconds are ignored.
struct PresetGoal {
  /// dB above the quality of the preset. Every 6.02 dB halve the bound of a surface.
  double abovePreset = 0.0;
  friend auto operator<=>(const PresetGoal&, const PresetGoal&) = default;
};

/// The best grid that adds at most `bytes` to a file (bytesAdded). Ellipsoids use at least 98 % of
/// these bytes, less 7 for the padding of each chunk, unless more bytes would not improve the grid; with the signs of a
/// narrow band, usually 95 %.
/// FitOptions::count, psnr and seconds are ignored.
struct SizeGoal {
  std::uint64_t bytes = 0;
  friend auto operator<=>(const SizeGoal&, const SizeGoal&) = default;
};

/// The smallest grid found whose PSNR over the box is at least `psnr`. FitOptions::count is the
/// largest number of ellipsoids; FitOptions::psnr and seconds are ignored.
struct PsnrGoal {
  double psnr = 0.0;  ///< dB
  friend auto operator<=>(const PsnrGoal&, const PsnrGoal&) = default;
};

/// The smallest grid found whose transmittance has at least this PSNR (TransmittancePsnr::psnr50,
/// metrics.h). A volume that is not looked through is converted as for a PresetGoal. FitOptions are as for a
/// PsnrGoal.
struct PictureGoal {
  double psnr = 0.0;  ///< dB
  friend auto operator<=>(const PictureGoal&, const PictureGoal&) = default;
};

/// A grid of voxels that restores every voxel within a bound.
struct BoundGoal {
  double bound = 0.0;  ///< largest absolute error, 0 or above
  /// `bound` is a share of valueRangeOf() of the volume (metrics.h). The components of a vector have
  /// one range, valueRangeOfVectors(), so that their bound should be given in units of the values.
  bool relative = false;
  friend auto operator<=>(const BoundGoal&, const BoundGoal&) = default;
};

/// A grid of voxels whose errors are at most a share of each value: |error| <= share max(|value|, floor). With a
/// background of 0, voxels are stored on the lattice of a tone curve (tone.h), whose steps grow with the
/// values; otherwise all have the bound that suits the smallest value.
struct RelativeBoundGoal {
  double share = 0.0;  ///< above 0 and below 1
  /// Magnitude below which the bound no longer falls, above 0. Default: leastMagnitude() of the volume
  /// (metrics.h).
  std::optional<double> floor{};
  friend auto operator<=>(const RelativeBoundGoal&, const RelativeBoundGoal&) = default;
};

/// A grid that restores every voxel and the active mask bit for bit. It holds voxels.
struct LosslessGoal {
  friend auto operator<=>(const LosslessGoal&, const LosslessGoal&) = default;
};

using Goal = std::variant<FitGoal, PresetGoal, SizeGoal, PsnrGoal, PictureGoal, BoundGoal,
                          RelativeBoundGoal, LosslessGoal>;

/// The quality that a preset stands for.
struct PresetQuality {
  double psnr = 0.0;         ///< PSNR over the active voxels, dB
  double picturePsnr = 0.0;  ///< PSNR of the transmittance, dB
  /// The largest error of a value of a level set, relative to the change of the values by one voxel across the surface:
  /// about the largest distance by which the surface moves, in voxels.
  double surfaceBound = 0.0;
};
[[nodiscard]] PresetQuality qualityOf(Preset preset);

/// What the quality of a PresetGoal and of a SizeGoal means.
enum class Measure {
  /// What is seen of a volume that is looked through (isLookedThrough, metrics.h; background 0): the PSNR
  /// of its transmittance for T = 0.5, unless the PSNR over the active voxels limits it: it may be 4 dB
  /// lower with a tone curve, and must be 2 dB higher without one. A level set that is no narrow band, or
  /// for a preset one of more than 16 voxels, is judged by its surface, since its values far from it, such as
  /// markers of empty space, may be of any size: it is stored as voxels, with PresetQuality::surfaceBound for a preset. For any other volume, as kValues.
  kAuto,
  kValues  ///< the PSNR of values
};

/// What a stored grid consists of. Goals with a bound and a LosslessGoal always store voxels.
enum class Representation {
  /// Ellipsoids or voxels: those with the higher PSNR for a SizeGoal, and those that take fewer
  /// bytes for a PsnrGoal and a PresetGoal; exact voxels where they take hardly more. A FitGoal
  /// stores ellipsoids unless exact voxels take no more bytes. Which of the two is better is usually
  /// known from a sample of the voxels and from a short fit, so that only one of them is completed.
  kAuto,
  /// Ellipsoids. Those of a narrow band have a residual where the sign of a voxel would be wrong.
  kEllipsoids,
  kVoxels
};

/// The form of ellipsoids in a file. kFloat32 is never replaced by voxels.
enum class Storage {
  kCompact,  ///< quantised and entropy-coded: 7 to 12 bytes per ellipsoid
  kFloat32   ///< float32 parameters: about 34 bytes per ellipsoid
};

struct StorageOptions {
  Storage form = Storage::kCompact;
  /// How active voxels are stored. Level sets that are stored as voxels always take kExact.
  Activity activity = Activity::kByValue;
};

/// The effort of conversions unless options say otherwise, and its limits.
inline constexpr int kUsualEffort = 5, kLeastEffort = 1, kMostEffort = 9;

/// The outcome of quantising the ellipsoids.
struct CompactRecord {
  double loss = 0.0;     ///< loss of PSNR over the box against float32, dB
  QuantiserSteps steps;  ///< quantisation steps of the four streams
};

struct ConvertOptions {
  Goal goal;
  /// How long a conversion may take, from kLeastEffort to kMostEffort. A step below kUsualEffort divides the iterations
  /// of fits by 1.6. The least effort fits only what is smooth: where voxels of the quality take less than 1.25 bits for
  /// each active voxel, or the size is less than 2 bits. On the CPU, the fits of large volumes have fewer iterations than
  /// those of small ones, and none where too few remain; a step above kUsualEffort makes these half as long again, up to
  /// those of small volumes. Conversion::fitsTookTooLong says whether none was made. A FitGoal has as many iterations
  /// more or fewer.
  int effort = kUsualEffort;
  Representation representation = Representation::kAuto;
  Measure measure = Measure::kAuto;
  /// The tone curve by which values are coded (tone.h). A curve without a scale is none. Default: for
  /// the goals that are measured in pictures, one that is chosen from the values and by short fits; none
  /// otherwise. A BoundGoal, a LosslessGoal and a background other than 0 have none in any case, and a
  /// RelativeBoundGoal has one of its own.
  std::optional<ToneCurve> tone{};
  FitOptions fit{};  ///< narrowBand is set by the conversion
  StorageOptions storage{};
  /// The same grid of the decoded previous frame of a sequence; null: the grid stands alone. Bytes
  /// are then those of a frame (bytesInFrame), and voxels are chosen so that they take few of them.
  /// Another grid that this one refers to in its file may take its place.
  /// For a goal that is a quality, a frame has the representation and the tone curve of the frame before: voxels
  /// are predicted from its voxels, and a fit continues its ellipsoids, which takes less time than a search. Where that
  /// takes many more bytes, or misses the goal, the frame is converted as if it stood alone.
  const StoredGrid* previous = nullptr;
  /// How the ellipsoids of `previous` were rounded. Those of the frame are rounded alike, or a little more or less.
  std::optional<CompactRecord> previousCompact{};
  /// The places of active voxels whose errors do not count, because the conversion has chosen their values; null: there are
  /// none. It is set by convertVolume() where the source has values that are not finite.
  const VoxelLayer* filled = nullptr;
  /// Voxels keep a part of the errors of the previous frame, if there is one. Errors that stay in
  /// their places flicker less, for a few bytes more. It is false where `previous` is another grid.
  bool keepsPastErrors = true;
};

/// A volume and its other properties.
struct ConvertInput {
  const GridDescriptor& descriptor;
  const SparseVolume& source;
};

/// A hash of all that a conversion depends on besides its options: the volume bit for bit, whether
/// the grid is a level set, and whether its values were doubles. Inputs with the same key are
/// converted to grids that differ in their descriptors only, except that a SizeGoal counts the
/// bytes of the descriptor.
struct InputKey {
  std::uint64_t low = 0, high = 0;
  friend auto operator<=>(const InputKey&, const InputKey&) = default;
};
[[nodiscard]] InputKey keyOf(const ConvertInput& input);

/// A grid that was considered for a goal.
struct Candidate {
  std::uint64_t bytes = 0;  ///< bytesAdded
  /// PSNR over the box, dB; +inf for exact voxels. Nothing if it was not measured.
  std::optional<double> psnr{};
  /// The figures were extrapolated from a short fit, from a sample, or from the first bricks of
  /// voxels that are too large; or the bytes are the least that voxels can take where ellipsoids take far fewer.
  bool estimated = false;
  /// Wall-clock seconds that all trials for this candidate took; nothing if none was made.
  std::optional<double> seconds{};
};

/// The candidates for a goal that voxels and ellipsoids can both reach.
struct ChoiceRecord {
  std::optional<Candidate> voxels;      ///< nothing if they cannot reach the goal or were not tried
  std::optional<Candidate> ellipsoids;  ///< nothing if they cannot reach the goal or were not tried
};

struct Conversion {
  StoredGrid grid;                       ///< the grid that a reader of the file gets
  FitResult fit;                         ///< its field is empty; unused if voxels are stored
  std::optional<CompactRecord> compact;  ///< set if ellipsoids are stored as kCompact
  std::optional<ChoiceRecord> choice;    ///< set if voxels were considered for the goal
  /// True if the goal was measured by what is seen (Measure::kAuto, PictureGoal). The figures of candidates
  /// in dB then are those of this measure.
  bool byPictures = false;
  /// With a SizeGoal, about the PresetGoal::abovePreset of the same quality; 0 if it is not known.
  double abovePreset = 0.0;
  /// The bound on the errors of a level set that was judged by its surface, value units.
  std::optional<double> surfaceBound{};
  /// True if ellipsoids were not tried because fitting them would take longer than the effort allows.
  bool fitsTookTooLong = false;
  /// Bytes of exact voxels, estimated from a sample, if they are fewer than those of the ellipsoids
  /// on which the representation or the storage insisted.
  std::optional<std::uint64_t> smallerExactBytes;
};

/// Converts a volume. The result is as deterministic as that of fit(). If a PSNR is out of reach,
/// the best fit found is returned with FitEnd::kPsnrMissed.
/// \throws UsageError  the grid does not fit into the size; the source of a LosslessGoal has
///                     doubles; a SizeGoal is combined with kFloat32; the goal and the
///                     representation or the storage exclude each other; a SizeGoal is too small for
///                     the ellipsoids of a narrow band and the residual of their signs
/// A volume whose background is far from its values (spanOf, volume.h) is converted relative
/// to a value among them, with its exact mask whatever StorageOptions::activity says, unless the goal
/// is lossless (StoredGrid::farBackground).
/// Active voxels that are NaN or infinite are kept (StoredGrid::nonFinite): the volume is converted with values there
/// that take few bytes, and every goal is meant for the other voxels.
/// Values that differ from the background by more than 2^120 (1.3e36) are too large for sums in
/// float32; such a grid is stored as voxels.
/// \throws BadInput  values are too large for sums, and the goal or an option needs ellipsoids (the
///                   text names the grid and the voxel)
/// \throws CannotConvert  active voxels are 2^24 voxels or more apart
/// \throws RuntimeFailure  the stored grid exceeds its bound; a voxel of a narrow band has another
///                         sign than in the source (the text names the grid and the voxel)
/// \throws RuntimeFailure  no quantisation lattice can hold the ellipsoids. Other exceptions are those of fit.
[[nodiscard]] Conversion convertVolume(const ConvertInput& input, const ConvertOptions& options);

struct PaperConversion {
  Conversion conversion;
  PaperRecord record;
};

/// Converts a volume with a fit by the paper's method, for comparison.
/// \throws UsageError  the volume is a narrow band; k is learned for each ellipsoid, but the
///                     storage is kCompact
/// \throws BadInput  values are too large for sums, as for convertVolume
/// Other exceptions are those of fitByPaper.
[[nodiscard]] PaperConversion convertByPaper(const ConvertInput& input,
                                             const PaperFitOptions& options,
                                             const StorageOptions& storage);

// Coarser levels of detail of a grid: the most important of its ellipsoids.

/// Keeps the first importance layers of a grid and drops its residual. A grid that has no more
/// layers is returned unchanged.
[[nodiscard]] StoredGrid firstLayers(StoredGrid grid, std::size_t layers);

/// Keeps the `count` ellipsoids of the largest weight of a grid, in their order. The weight is
/// |I| sqrt(s1 s2 s3): the root of the ellipsoid's sum of squares over voxels, up to a factor that
/// depends on kappa only. The result has no quantised form, no layers and no residual. A grid that
/// has no more ellipsoids is returned unchanged.
[[nodiscard]] StoredGrid heaviest(StoredGrid grid, std::size_t count);

}  // namespace esvr
