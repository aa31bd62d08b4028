#pragma once
/// Other formats with which ESVR is compared on the same voxels: lossless and quantised VDB files,
/// and ZFP if the library was built with it.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "esvr/device.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"

namespace esvr {

/// The lossy modes of ZFP whose size depends on the data.
enum class ZfpMode {
  kAccuracy,  ///< largest error of a voxel, which ZFP rounds down to a power of two
  kPrecision  ///< number of bit planes that each block of 4^3 voxels keeps
};

inline constexpr unsigned kMaxZfpPlanes = 32;  ///< bit planes of a float

struct ZfpSetting {
  ZfpMode mode = ZfpMode::kAccuracy;
  double amount = 0.0;
  /// True for an array of the bricks of 8^3 voxels that exist, and their positions. Otherwise it is
  /// an array of the whole box.
  bool bricks = false;
};

/// Version of ZFP, for example "ZFP 1.0.0"; empty if the library was built without it.
[[nodiscard]] std::string zfpVersion();

struct BaselineSetting {
  std::variant<VoxelPacking, ZfpSetting> how;
  /// For VDB files only. If the threshold is above 0, voxels that differ from the background by no
  /// more than the threshold are made inactive before encoding, and empty leaves are removed. In a
  /// level set these are the voxels within this distance of the band's edge.
  double threshold = 0.0;
};

/// The name of a setting on a command line, without loss of digits. Examples:
/// "nvdb-fpn-zip,tolerance=0.35,threshold=0.6", "vdb-half-blosc", "zfp,accuracy=0.25",
/// "zfp-bricks,precision=9".
[[nodiscard]] std::string toString(const BaselineSetting& setting);
/// The inverse of toString.
/// \throws UsageError  the text names no setting; the message lists the possible ones
[[nodiscard]] BaselineSetting parseBaseline(const std::string& text);

/// Half of the smallest difference between an active voxel and the background, by which the voxels of a format without an
/// active mask are found to be active. Active voxels that equal the background are ignored.
[[nodiscard]] float activityThreshold(const SparseVolume& volume);

struct BaselineSource {
  const VolumeGrid& grid;
  Box box;                          ///< box over which PSNR is measured; ZFP stores its voxels only
  double peak = 1.0;                ///< peak value of the PSNR
  std::filesystem::path folder;     ///< folder for temporary files
  std::uint64_t maxDenseBytes = 0;  ///< limit on ZFP's array of floats; 0: no limit
  const CancelToken* cancel = nullptr;
};

/// Encodes one grid at various settings, one after the other.
class BaselineEncoder {
 public:
  explicit BaselineEncoder(const BaselineSource& source);
  ~BaselineEncoder();
  BaselineEncoder(const BaselineEncoder&) = delete;
  BaselineEncoder& operator=(const BaselineEncoder&) = delete;

  struct Encoded {
    std::uint64_t bytes = 0;
    double seconds = 0.0;  ///< time from the method's own form in memory to the file
  };
  /// \throws UsageError  the grid does not allow the setting (the text says why), or the library
  ///                     was built without the method
  /// \throws Cancelled   BaselineSource::cancel was set
  Encoded encode(const BaselineSetting& setting);
  /// Seconds that the method takes to read the last encoded file into memory.
  [[nodiscard]] double secondsToDecode() const;
  /// The voxels of the last encoded file. ZFP stores no active mask: a voxel of a ZFP file is active if it differs from
  /// the background by more than the activityThreshold of the source.
  [[nodiscard]] SparseVolume decode() const;

  [[nodiscard]] const BaselineSource& source() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// One trial of a search.
struct MatchStep {
  BaselineSetting setting;
  std::uint64_t bytes = 0;
  double psnr = 0.0;  ///< dB over the voxels of the search; NaN if it did not need it
};

struct Match {
  bool found = false;
  MatchStep best;
  std::vector<MatchStep> steps;  ///< all trials, in order
};

/// Searches for the setting with the highest PSNR that takes at most `bytes`. The form and the
/// codec are those of `like`. The search varies FpN's tolerance, ZFP's amount and, for VDB files,
/// the threshold; it bisects the threshold until the size is at most 2 % below the limit.
[[nodiscard]] Match matchSize(BaselineEncoder& encoder, const BaselineSetting& like,
                              std::uint64_t bytes);

/// The PSNR that a search must reach.
struct MatchGoal {
  double psnr = 0.0;         ///< dB
  bool active = false;       ///< over the active voxels of the source; otherwise over the box
  bool dropsVoxels = false;  ///< whether VDB files may drop voxels near the background
};

/// Searches for the setting with the fewest bytes that reaches a PSNR. The search varies FpN's
/// tolerance, ZFP's amount and, where voxels may be dropped, the threshold.
/// \throws UsageError  the form has nothing that could vary
[[nodiscard]] Match matchPsnr(BaselineEncoder& encoder, const BaselineSetting& like,
                              const MatchGoal& goal);

}  // namespace esvr
