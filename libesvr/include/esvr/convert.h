#pragma once
/// Converts a volume to a stored grid. vdb2esvr and esvr-compare call it for every grid.
///
/// A goal states a condition for the stored grid. A conversion may make several fits to reach its
/// goal.

#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

#include "esvr/compact.h"
#include "esvr/container.h"
#include "esvr/fit.h"
#include "esvr/grid.h"
#include "esvr/paper_method.h"
#include "esvr/quantised.h"
#include "esvr/volume.h"

namespace esvr {

/// A single fit, which ends as FitOptions determine.
struct FitGoal {};

/// The smallest grid found whose error is at most that of presetPsnr(FitOptions::preset) over the
/// active voxels. Errors at inactive voxels of the box count too, so that the PSNR over the active
/// voxels alone is at least as high. The time is bounded: on the CPU, fits of large volumes have
/// fewer iterations. FitOptions::count, psnr and seconds are ignored. A volume of more than 2^25
/// voxels in bricks is converted as for a FitGoal, unless the representation is kVoxels; its
/// quality then is that of its fit.
struct PresetGoal {
  /// True: a volume of more than 2^25 voxels has the PSNR of the preset too. This takes several
  /// fits with all iterations. The frames of a sequence then have one quality, whatever their size.
  bool steady = false;
};

/// The best grid that adds at most `bytes` to a file (bytesAdded). Ellipsoids use at least 98 % of
/// these bytes, less 7 for the padding of each chunk, unless more bytes would not improve the grid.
/// FitOptions::count, psnr and seconds are ignored.
struct SizeGoal {
  std::uint64_t bytes = 0;
};

/// The smallest grid found whose PSNR over the box is at least `psnr`. FitOptions::count is the
/// largest number of ellipsoids; FitOptions::psnr and seconds are ignored.
struct PsnrGoal {
  double psnr = 0.0;  ///< dB
};

/// A grid of voxels that restores every voxel within a bound.
struct BoundGoal {
  double bound = 0.0;  ///< largest absolute error, 0 or above
  /// `bound` is a share of valueRangeOf() of the volume (metrics.h). The components of a vector have
  /// one range, valueRangeOfVectors(), so that their bound should be given in units of the values.
  bool relative = false;
};

/// A grid that restores every voxel and the active mask bit for bit. It holds voxels.
struct LosslessGoal {};

using Goal = std::variant<FitGoal, PresetGoal, SizeGoal, PsnrGoal, BoundGoal, LosslessGoal>;

/// PSNR over the active voxels that a preset stands for, dB.
[[nodiscard]] double presetPsnr(Preset preset);

/// What a stored grid consists of. A BoundGoal and a LosslessGoal always store voxels.
enum class Representation {
  /// Ellipsoids or voxels: those with the higher PSNR for a SizeGoal, and those that take fewer
  /// bytes for a PsnrGoal. A FitGoal stores ellipsoids unless exact voxels take no
  /// more bytes. If the bricks of the volume have more than 2^25 voxels, goals other than a
  /// BoundGoal store either exact voxels or ellipsoids. Coding voxels takes long then, so that it
  /// is done only if an estimate from a sample says that they may be small enough.
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
  /// How active voxels are stored. For Activity::kAuto, a SizeGoal takes kNoMask where a simplified
  /// mask would take more than a quarter of the size, and kByValue where the thresholds of blocks
  /// would. Level sets that are stored as voxels always
  /// take kExact.
  Activity activity = Activity::kAuto;
};

struct ConvertOptions {
  Goal goal;
  Representation representation = Representation::kAuto;
  FitOptions fit;  ///< narrowBand is set by the conversion
  StorageOptions storage;
  /// The same grid of the decoded previous frame of a sequence; null: the grid stands alone. Bytes
  /// are then those of a frame (bytesInFrame), and voxels are chosen so that they take few of them.
  /// Another grid that this one refers to in its file may take its place.
  /// If it holds voxels, Representation::kAuto stores voxels for a PresetGoal and a PsnrGoal, so that
  /// only the first frame of a group takes the time of a fit.
  const StoredGrid* previous = nullptr;
  /// Voxels keep a part of the errors of the previous frame, if there is one. Errors that stay in
  /// their places flicker less, for a few bytes more. It is false where `previous` is another grid.
  bool keepsPastErrors = true;
};

/// A volume and its other properties.
struct ConvertInput {
  const GridDescriptor& descriptor;
  const SparseVolume& source;
  const SimplifiedMasks* simplified = nullptr;  ///< those of `source`, if they are kept
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

/// The outcome of quantising the ellipsoids.
struct CompactRecord {
  double loss = 0.0;     ///< loss of PSNR over the box against float32, dB
  QuantiserSteps steps;  ///< quantisation steps of the four streams
};

/// A grid that was considered for a goal.
struct Candidate {
  std::uint64_t bytes = 0;  ///< bytesAdded
  /// PSNR over the box, dB; +inf for exact voxels. Nothing if it was not measured.
  std::optional<double> psnr{};
  /// The figures were extrapolated from a short fit, from a sample, or from the first bricks of
  /// voxels that are too large.
  bool estimated = false;
  /// Wall-clock seconds that all trials for this candidate took; nothing if none was made.
  std::optional<double> seconds{};
};

/// The candidates for a goal that voxels and ellipsoids can both reach.
struct ChoiceRecord {
  std::optional<Candidate> voxels;      ///< nothing if they cannot reach the goal or were not tried
  std::optional<Candidate> ellipsoids;  ///< nothing if they cannot reach the goal or were not tried
};

/// What a conversion found out about a means of making a grid better or smaller. Figures that were
/// not measured are missing. If the goal is a size, both grids fill it, and the one with the higher
/// PSNR is stored.
struct Decision {
  bool tried = false;                           ///< grids with it were made to be compared
  bool used = false;                            ///< the stored grid has it
  std::optional<std::uint64_t> bytesWith{};     ///< bytesAdded of the best grid with it
  std::optional<std::uint64_t> bytesWithout{};  ///< bytesAdded of the best grid without it
  std::optional<double> seconds{};              ///< wall-clock seconds that deciding took
};

/// The decisions of a conversion besides that between voxels and ellipsoids (ChoiceRecord).
struct DecisionRecord {
  /// Intensities of both signs although all values have one sign. The clamp makes this possible: it
  /// removes what the sum has beyond the range of the values.
  Decision bothSigns;
  /// A quantisation lattice of voxels that contains the most frequent value, the plateau.
  Decision plateau;
};

struct Conversion {
  StoredGrid grid;                       ///< the grid that a reader of the file gets
  FitResult fit;                         ///< its field is empty; unused if voxels are stored
  std::optional<CompactRecord> compact;  ///< set if ellipsoids are stored as kCompact
  std::optional<ChoiceRecord> choice;    ///< set if voxels were considered for the goal
  DecisionRecord decisions;
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
/// Values that differ from the background by more than 2^120 (1.3e36) are too large for sums in
/// float32; such a grid is stored as voxels.
/// \throws BadInput  values are too large for sums, and the goal or an option needs ellipsoids (the
///                   text names the grid and the voxel)
/// \throws RuntimeFailure  the stored grid exceeds its bound; a voxel of a narrow band has another
///                         sign than in the source (the text names the grid and the voxel)
/// Other exceptions are those of fit and compactGrid.
[[nodiscard]] Conversion convertVolume(const ConvertInput& input, const ConvertOptions& options);

struct PaperConversion {
  Conversion conversion;
  PaperRecord record;
};

/// Converts a volume with a fit by the paper's method, for comparison.
/// \throws UsageError  the volume is a narrow band; k is learned for each ellipsoid, but the
///                     storage is kCompact
/// \throws BadInput  values are too large for sums, as for convertVolume
/// Other exceptions are those of fitByPaper and compactGrid.
[[nodiscard]] PaperConversion convertByPaper(const ConvertInput& input,
                                             const PaperFitOptions& options,
                                             const StorageOptions& storage);

// Chooses the grids of a file whose voxels are the context of other grids' voxels (VoxelReference),
// so that they take fewer bytes.

/// Chooses a reference for a grid of voxels. Candidates are compared on a sample of its bricks.
/// \param grids  the grids of a file. Those of `candidates` must be before `grid`, and those among
///               them that hold no voxels are ignored.
/// \return the reference with which the voxels take the fewest bytes of those that were tried, the
///         empty one among them. They may take even fewer without a reference (bytesAdded).
[[nodiscard]] VoxelReference chooseReference(std::span<const StoredGrid> grids, std::size_t grid,
                                             std::span<const std::size_t> candidates);

/// The grid that a reference names, with the values that are expected for the grid that refers to
/// it. As ConvertOptions::previous it makes a conversion choose voxels that take few bytes with this
/// reference.
/// \param grid  refers to the other grid
[[nodiscard]] StoredGrid expectedFrom(std::span<const StoredGrid> grids, std::size_t grid,
                                      const VoxelReference& reference);

}  // namespace esvr
