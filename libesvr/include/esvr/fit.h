#pragma once
/// Fits ellipsoids to a sparse volume.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "esvr/volume.h"

namespace esvr {

// Where the parts of a fit in chunks are run. A part is the fit of one chunk in one round
// (docs/scale.md).

/// A hash of everything that the result of a part depends on.
using PartKey = std::array<std::uint64_t, 2>;

/// The result of a part.
struct PartOutput {
  std::vector<std::byte> bytes;
  bool complete = true;  ///< false if the fit was cancelled: another run must not use the result
};

/// The parts of a round. They do not depend on each other. All functions may be called on several
/// threads at the same time.
class RoundParts {
 public:
  virtual ~RoundParts() = default;
  [[nodiscard]] virtual int round() const = 0;  ///< number of the round, from 0
  [[nodiscard]] virtual std::size_t count() const = 0;
  [[nodiscard]] virtual PartKey keyOf(std::size_t part) const = 0;
  /// Fits a part. After a cancellation it returns at once.
  [[nodiscard]] virtual PartOutput fit(std::size_t part, const Device& device) const = 0;
};

/// Runs the parts of a round. The result does not depend on the implementation.
class PartRunner {
 public:
  virtual ~PartRunner() = default;
  /// \return PartOutput::bytes of every part, in order
  [[nodiscard]] virtual std::vector<std::vector<std::byte>> run(const RoundParts& parts) = 0;
};

/// A preset determines the number of ellipsoids and the length of the schedule if they are not
/// given, and the quality of a PresetGoal (encode.h).
enum class Preset { kDraft, kStandard, kHigh };

/// Usual gain of PSNR by twice the ellipsoids, dB. It serves estimates only.
inline constexpr double kDbPerDoubling = 4.5;

/// The state of a running fit. It is reported about four times a second.
struct FitProgress {
  TimedCurvePoint point;
  double fraction = 0.0;         ///< share of the run that is done, 0 to 1
  double secondsLeft = 0.0;      ///< estimated time to the end of the run
  double voxelsPerSecond = 0.0;  ///< active voxels times `fraction`, in a second
  /// Parts of a fit in chunks; 1 part of a fit in one chunk.
  std::size_t partsDone = 0, parts = 1;
};

/// The options that fit() and fitByPaper() (paper_method.h) have in common.
struct CommonFitOptions {
  std::optional<std::size_t> count;  ///< number of ellipsoids; default: the method's own number
  std::optional<double> psnr;        ///< dB over the box; the fit ends as soon as it is reached
  std::optional<double> seconds;     ///< time limit; the fit then ends with its best state
  std::optional<Box> box;            ///< box over which PSNR is measured; default: the active box
  std::optional<double> peak;        ///< peak of the PSNR, above 0; default: peakOf() of the volume
  std::uint64_t seed = 1;
  Device device;                              ///< the CPU or a GPU (selectDevice)
  std::optional<std::size_t> maxDeviceBytes;  ///< GPU memory to use; default: all free memory
  const CancelToken* cancel = nullptr;  ///< a cancelled fit returns its best state as kCancelled
  std::function<void(const FitProgress&)> progress;
};

/// The options of fit(). The run ends as soon as one of psnr, seconds and iterations is reached.
/// Options that are not given follow from the preset and the data.
struct FitOptions : CommonFitOptions {
  std::optional<std::uint32_t> iterations;  ///< length of the schedule
  Preset preset = Preset::kStandard;
  std::optional<float> kappa;  ///< edge of the kernel; default: it is fitted with the ellipsoids
  /// The volume is a level set: voxels outside its bricks do not count.
  bool narrowBand = false;
  /// Intensities may have both signs, also if all values have one. A sum can then end sharply at
  /// the border of a plateau, which it exceeds inside. This gains up to 4 dB on some volumes and
  /// loses up to 2 dB on others, and a fit takes about twice as long (docs/lab-notes.md, "Signs").
  /// Default: fit() allows the signs of the values. The searches of convertVolume() for a size or a
  /// PSNR, which all goals but FitGoal and LosslessGoal use, choose by short fits if many voxels
  /// have an extreme value.
  std::optional<bool> bothSigns;
  /// The volume is fitted in chunks of about this many active voxels (docs/scale.md): the chunks have
  /// at most as many bricks as have these voxels on average. Default: in one chunk, or in the
  /// largest chunks that fit into the memory of the GPU and within maxHostBytes.
  std::optional<std::uint64_t> chunkVoxels;
  /// Memory of the host that the fit may take beside the volume. Default: no limit.
  std::optional<std::uint64_t> maxHostBytes{};
  /// Runs the parts of a fit in chunks. It must outlive the call. Null: they run on `device`, one
  /// after the other.
  PartRunner* parts = nullptr;
  /// A field that was fitted to the same volume. The fit continues from its ellipsoids and its
  /// edge, and adds ellipsoids until there are `count`. The field must outlive the call. Null: the
  /// fit begins with seeds.
  const Field* start = nullptr;
};

enum class FitEnd { kScheduleDone, kPsnrReached, kTimeUp, kCancelled, kPsnrMissed };

struct FitResult {
  Field field;
  ValueRange range{};  ///< range of the volume's values, to which sums are clamped
  std::vector<TimedCurvePoint> curve;
  FitEnd end = FitEnd::kScheduleDone;
  /// Wall-clock times. secondsSeed covers the seeding at the start, growth and relocation, and is
  /// not part of secondsOptimise.
  double secondsSeed = 0.0, secondsOptimise = 0.0;
  std::size_t wanted = 0;       ///< ellipsoids that fit() aimed at; 0 for fitByPaper()
  std::size_t deviceBytes = 0;  ///< largest GPU memory held; 0 on the CPU
  std::size_t chunks = 0;       ///< number of chunks of the fit; 0 for fitByPaper()
  bool deviceFull = false;      ///< true if GPU memory ran out: fewer ellipsoids than `wanted`
  /// (ellipsoid, brick) pairs that the final field evaluates. In a fit in chunks, an ellipsoid counts
  /// again in every chunk whose halo it is in.
  std::uint64_t pairs = 0;
  bool signedIntensities = false;  ///< true if an intensity is negative
};

/// The number of ellipsoids that a fit aims at: the given count, or the preset's for this number of
/// active voxels, but at most one for each of them.
[[nodiscard]] std::size_t plannedCount(const FitOptions& options, std::uint64_t activeVoxels);

/// The length of the schedule of a fit: the given number of iterations, or the preset's.
[[nodiscard]] std::uint32_t plannedIterations(const FitOptions& options);

/// Fits ellipsoids to a volume. Sums are clamped to the range of the volume's values, background
/// included, before they are compared with the volume. Where the volume has its largest value, a
/// sum may therefore exceed this value. A reader must clamp sums too, as decodeGrid() does.
///
/// The result is deterministic: the same volume, options and seed give the same bits on any number
/// of threads, and in every run on GPUs of one kind, unless `seconds` ends the run. CPU and GPU use
/// the same method and formulas but round differently, so that their fits differ slightly.
/// \return a result whose end is kPsnrMissed if options.psnr was given and not reached;
///         convertVolume (encode.h) searches for the smallest grid that reaches a PSNR
/// \throws BadInput    the volume has no active voxel
/// \throws UsageError  count is 0 or less than options.start has, or options contradict each other
/// \throws Cancelled   the fit was cancelled before it had a result
/// \throws DeviceError  the GPU cannot be used or has too little memory
/// \throws RuntimeFailure  the fit diverged
[[nodiscard]] FitResult fit(const SparseVolume& volume, const FitOptions& options);

}  // namespace esvr
