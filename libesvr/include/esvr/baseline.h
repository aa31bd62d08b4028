#pragma once
/// The forms that people store volumes in today, at a setting: lossless and quantised VDB files,
/// and ZFP where the library was built with it. A comparison runs them on the same voxels as an
/// .esvr.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "esvr/coord.h"
#include "esvr/progress.h"
#include "esvr/vdb_io.h"
#include "esvr/voxel_packer.h"

namespace esvr {

/// The lossy modes of ZFP whose size follows the data.
enum class ZfpMode {
  kAccuracy,  ///< largest error of a voxel; ZFP works in powers of two at or below it
  kPrecision  ///< bit planes of each block of 4^3
};

struct ZfpSetting {
  ZfpMode mode = ZfpMode::kAccuracy;
  double amount = 0.0;
};

/// "ZFP 1.0.0"; empty where the library was built without it.
[[nodiscard]] std::string zfpVersion();

struct BaselineSetting {
  std::variant<VoxelPacking, ZfpSetting> how;
  /// VDB files: where above 0, voxels that are not further from the background are made inactive
  /// first (in a level set, those within this of the band's edge), and empty leaves pruned.
  double threshold = 0.0;
};

/// "nvdb-fpn-zip,tolerance=0.35,threshold=0.6", "vdb-half-blosc", "zfp,accuracy=0.25": what a
/// setting is called on a command line, exactly.
[[nodiscard]] std::string toString(const BaselineSetting& setting);
/// \throws UsageError  not such a text; lists what there is
[[nodiscard]] BaselineSetting parseBaseline(const std::string& text);

struct BaselineSource {
  const VolumeGrid& grid;
  Box box;                          ///< PSNR is taken over it; ZFP stores its voxels and no others
  double peak = 1.0;                ///< the PSNR's peak
  std::filesystem::path folder;     ///< for files that come and go
  std::uint64_t maxDenseBytes = 0;  ///< bound on the box as an array of floats; 0: none
  const CancelToken* cancel = nullptr;
};

/// Encodes one grid at one setting after the other.
class BaselineEncoder {
 public:
  explicit BaselineEncoder(const BaselineSource& source);
  ~BaselineEncoder();
  BaselineEncoder(const BaselineEncoder&) = delete;
  BaselineEncoder& operator=(const BaselineEncoder&) = delete;

  struct Encoded {
    std::uint64_t bytes = 0;
    double seconds = 0.0;  ///< from the method's own form in memory to the file
  };
  /// \throws UsageError  a setting that this grid does not allow (says why), or of a method that
  /// the
  ///                     library was built without; Cancelled
  Encoded encode(const BaselineSetting& setting);
  /// Seconds that the method takes to have what was encoded last in memory.
  [[nodiscard]] double secondsToDecode() const;
  /// The voxels of what was encoded last. Of ZFP's, which has no active mask, those are active that
  /// differ from the background by more than half of what any active voxel of the source does.
  [[nodiscard]] SparseVolume decode() const;

  [[nodiscard]] const BaselineSource& source() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// One attempt of a search.
struct MatchStep {
  BaselineSetting setting;
  std::uint64_t bytes = 0;
  double psnr = 0.0;  ///< dB over the box; NaN where it was not needed
};

struct Match {
  bool found = false;
  MatchStep best;
  std::vector<MatchStep> steps;  ///< all that was tried, in order
};

/// The setting of the highest PSNR that takes at most so many bytes. The form and codec are those
/// of `like`; FpN's tolerance, ZFP's amount and, for VDB files, the threshold are searched: the
/// latter by bisection until the bytes are at most 2 % below.
[[nodiscard]] Match matchSize(BaselineEncoder& encoder, const BaselineSetting& like,
                              std::uint64_t bytes);

/// The setting of the fewest bytes that reaches a PSNR: of FpN's tolerance or ZFP's amount.
/// \throws UsageError  another form
[[nodiscard]] Match matchPsnr(BaselineEncoder& encoder, const BaselineSetting& like, double psnr);

}  // namespace esvr
