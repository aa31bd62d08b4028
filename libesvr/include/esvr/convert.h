#pragma once
/// Converts a volume to a stored grid. vdb2esvr and esvr-compare call it for every grid.
///
/// A goal states what the stored grid must satisfy. A conversion may make several fits to reach its
/// goal.

#include <compare>
#include <cstdint>
#include <optional>
#include <variant>

#include "esvr/compact.h"
#include "esvr/container.h"
#include "esvr/fit.h"
#include "esvr/grid_descriptor.h"
#include "esvr/paper_method.h"
#include "esvr/sparse_volume.h"
#include "esvr/voxel_layer.h"

namespace esvr {

/// A single fit, which ends as FitOptions determine.
struct FitGoal {};

/// The best grid that adds at most `bytes` to a file (bytesAdded). Ellipsoids use at least 98 % of
/// them unless more bytes would not improve the grid. FitOptions::count, psnr and seconds are
/// ignored.
struct SizeGoal {
  std::uint64_t bytes = 0;
};

/// The smallest grid found whose PSNR over the box is at least `psnr`. FitOptions::count is the
/// largest number of ellipsoids; FitOptions::psnr and seconds are ignored.
struct PsnrGoal {
  double psnr = 0.0;  ///< dB
};

/// Every voxel is restored within a bound. The grid holds voxels, or ellipsoids with a residual if
/// these take fewer bytes. FitOptions::count, psnr and seconds are ignored.
struct BoundGoal {
  double bound = 0.0;     ///< largest absolute error, 0 or above
  bool relative = false;  ///< `bound` is a share of the range of the active values
};

/// Every voxel and the active mask are restored bit for bit. The grid holds voxels.
struct LosslessGoal {};

using Goal = std::variant<FitGoal, SizeGoal, PsnrGoal, BoundGoal, LosslessGoal>;

/// What a stored grid consists of. A LosslessGoal always stores voxels.
enum class Representation {
  /// Ellipsoids or voxels, whichever serve the goal better. A FitGoal stores ellipsoids unless
  /// exact voxels take no more bytes. Voxels are not tried for volumes of more than 2^25 voxels in
  /// bricks, because coding them takes long.
  kAuto,
  /// Ellipsoids. For a BoundGoal they have a residual, which a narrow band cannot have.
  kEllipsoids,
  kVoxels
};

/// The form of ellipsoids in a file. kFloat32 is never replaced by voxels.
enum class Storage {
  kCompact,  ///< quantised and entropy coded: about 9 bytes per ellipsoid
  kFloat32   ///< float32 parameters: about 34 bytes per ellipsoid
};

struct StorageOptions {
  Storage form = Storage::kCompact;
  /// PSNR over the box, in dB, that kCompact may lose for a FitGoal. The other goals ignore it.
  double loss = CompactOptions::kDefaultLoss;
  Activity activity = Activity::kByValue;  ///< storage of the active mask
};

struct ConvertOptions {
  Goal goal;
  Representation representation = Representation::kAuto;
  FitOptions fit;  ///< narrowBand is set by the conversion
  StorageOptions storage;
};

/// A volume and its other properties.
struct ConvertInput {
  const GridDescriptor& descriptor;
  const SparseVolume& source;
};

/// A hash of all that a conversion depends on besides its options: the volume bit for bit, whether
/// the grid is a level set, and whether its values were doubles. Inputs with the same key are
/// converted to grids that differ in their descriptors only, except that a SizeGoal counts the bytes
/// of the descriptor.
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
  /// PSNR over the box, dB; +inf for exact voxels. Nothing for a BoundGoal.
  std::optional<double> psnr{};
  bool estimated = false;  ///< the figures were extrapolated from a short fit
};

/// The candidates for a goal that voxels and ellipsoids can serve.
struct ChoiceRecord {
  std::optional<Candidate> voxels;      ///< nothing if no voxels serve the goal or none were tried
  std::optional<Candidate> ellipsoids;  ///< nothing if no ellipsoids do, or none were tried
};

struct Conversion {
  StoredGrid grid;                       ///< the grid that a reader of the file gets
  FitResult fit;                         ///< its field is empty; unused if voxels are stored
  std::optional<CompactRecord> compact;  ///< set if ellipsoids are stored as kCompact
  std::optional<ChoiceRecord> choice;    ///< set if the goal can be served by voxels, too
};

/// Converts a volume. The result is as deterministic as that of fit(). If a PSNR is out of reach,
/// the best fit found is returned with FitEnd::kPsnrMissed.
/// \throws UsageError  the size cannot hold the grid; a lossless grid is wanted of doubles; a size
///                     is wanted with kFloat32; the goal and the representation exclude each
///                     other; no ellipsoids with a residual keep a bound
/// \throws RuntimeFailure  the stored grid does not keep its bound
/// Other exceptions are those of fit and compactGrid.
[[nodiscard]] Conversion convertVolume(const ConvertInput& input, const ConvertOptions& options);

struct PaperConversion {
  Conversion conversion;
  PaperRecord record;
};

/// Converts a volume with a fit by the paper's method, for comparison.
/// \throws UsageError  the volume is a narrow band; k is learned for each ellipsoid, but the
///                     storage is kCompact
/// Other exceptions are those of fitByPaper and compactGrid.
[[nodiscard]] PaperConversion convertByPaper(const ConvertInput& input,
                                             const PaperFitOptions& options,
                                             const StorageOptions& storage);

}  // namespace esvr
