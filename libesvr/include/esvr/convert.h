#pragma once
/// Converts a volume to a stored grid. vdb2esvr and esvr-compare call it for every grid.
///
/// A goal states what the stored grid must satisfy. A conversion may make several fits to reach its
/// goal.

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

/// The best grid that adds at most `bytes` to a file (bytesAdded). It uses at least 98 % of them
/// unless more bytes would not improve it. FitOptions::count, psnr and seconds are ignored.
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
  double bound = 0.0;       ///< largest absolute error, 0 or above
  bool relative = false;    ///< `bound` is a share of the range of the active values
  bool voxelsOnly = false;  ///< ellipsoids are not tried
};

/// Every voxel and the active mask are restored bit for bit. The grid holds voxels.
struct LosslessGoal {};

using Goal = std::variant<FitGoal, SizeGoal, PsnrGoal, BoundGoal, LosslessGoal>;

/// The representation of ellipsoids in a file.
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
  FitOptions fit;  ///< narrowBand is set by the conversion
  StorageOptions storage;
};

/// A volume and its other properties.
struct ConvertInput {
  const GridDescriptor& descriptor;
  const SparseVolume& source;
};

/// The outcome of quantising the ellipsoids.
struct CompactRecord {
  double loss = 0.0;     ///< loss of PSNR over the box against float32, dB
  QuantiserSteps steps;  ///< quantisation steps of the four streams
};

/// The sizes of the two representations that a BoundGoal compares.
struct BoundRecord {
  std::uint64_t voxelBytes = 0;      ///< size of the grid with voxels only
  std::uint64_t ellipsoidBytes = 0;  ///< size of the smallest grid with ellipsoids; 0: none
};

struct Conversion {
  StoredGrid grid;                       ///< the grid that a reader of the file gets
  FitResult fit;                         ///< its field is empty; unused if voxels are stored
  std::optional<CompactRecord> compact;  ///< set if ellipsoids are stored as kCompact
  std::optional<BoundRecord> bound;      ///< set if ellipsoids and voxels were compared
};

/// Converts a volume. The result is as deterministic as that of fit(). If a PSNR is out of reach,
/// the best fit found is returned with FitEnd::kPsnrMissed.
/// \throws UsageError  the size cannot hold the grid; a lossless grid is wanted of doubles; a size
///                     is wanted with kFloat32
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
