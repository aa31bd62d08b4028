#pragma once
/// Converts a volume to a stored grid: what vdb2esvr and esvr-compare do to every grid.
///
/// A goal says what the stored grid must be; everything else follows from it. Several fits may be
/// needed to reach one.

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

/// One fit, which ends as FitOptions say.
struct FitGoal {};

/// The best grid that adds at most so many bytes to a file (bytesAdded). It takes at least 98 % of
/// them where the volume has use for them. FitOptions::count, psnr and seconds are ignored.
struct SizeGoal {
  std::uint64_t bytes = 0;
};

/// The smallest grid found whose PSNR over the box is at least this. FitOptions::count bounds the
/// number of ellipsoids; its psnr and seconds are ignored.
struct PsnrGoal {
  double psnr = 0.0;  ///< dB
};

/// Every voxel comes back within a bound: as voxels, or as ellipsoids with a residual where these
/// take fewer bytes. FitOptions::count, psnr and seconds are ignored.
struct BoundGoal {
  double bound = 0.0;       ///< largest absolute error, 0 or above
  bool relative = false;    ///< `bound` is a share of the range of the active values
  bool voxelsOnly = false;  ///< ellipsoids are not tried
};

/// Every voxel and the active mask come back bit for bit, as voxels.
struct LosslessGoal {};

using Goal = std::variant<FitGoal, SizeGoal, PsnrGoal, BoundGoal, LosslessGoal>;

/// How a file holds the parameters of ellipsoids.
enum class Storage {
  kCompact,  ///< on a quantisation lattice, entropy coded: about 9 bytes an ellipsoid
  kFloat32   ///< about 34 bytes an ellipsoid
};

/// How what was fitted is stored.
struct StorageOptions {
  Storage form = Storage::kCompact;
  /// PSNR over the box that kCompact may cost a FitGoal, dB. A goal for a size or a PSNR chooses it.
  double loss = CompactOptions::kDefaultLoss;
  Activity activity = Activity::kByValue;  ///< what is stored of which voxels are active
};

struct ConvertOptions {
  Goal goal;
  FitOptions fit;  ///< narrowBand is set by the conversion
  StorageOptions storage;
};

/// The volume, and what a file says of it besides.
struct ConvertInput {
  const GridDescriptor& descriptor;
  const SparseVolume& source;
};

/// What quantising the ellipsoids did.
struct CompactRecord {
  double loss = 0.0;     ///< dB over the box, against float32
  QuantiserSteps steps;  ///< of the four streams
};

/// The two representations that a BoundGoal compared.
struct BoundRecord {
  std::uint64_t voxelBytes = 0;  ///< of the grid as voxels alone
  std::uint64_t ellipsoidBytes =
      0;  ///< of the smallest grid with ellipsoids that was tried; 0: none
};

struct Conversion {
  StoredGrid grid;                       ///< as a reader of the file gets it
  FitResult fit;                         ///< without its field; unused where voxels are stored
  std::optional<CompactRecord> compact;  ///< where ellipsoids are stored as kCompact
  std::optional<BoundRecord> bound;      ///< where ellipsoids and voxels were compared
};

/// Deterministic as fit() is. Where a PSNR is out of reach, the best fit found is returned, marked
/// kPsnrMissed.
/// \throws UsageError  a size that cannot hold the grid, a lossless file of doubles, a size with
///                     kFloat32; RuntimeFailure  the stored grid does not keep the bound; else as
///                     fit and compactGrid
[[nodiscard]] Conversion convertVolume(const ConvertInput& input, const ConvertOptions& options);

struct PaperConversion {
  Conversion conversion;
  PaperRecord record;
};

/// The same by the paper's method, for comparison with it.
/// \throws UsageError  a level set; a k learned for each ellipsoid with kCompact; else as fitByPaper
///                     and compactGrid
[[nodiscard]] PaperConversion convertByPaper(const ConvertInput& input,
                                             const PaperFitOptions& options,
                                             const StorageOptions& storage);

}  // namespace esvr
