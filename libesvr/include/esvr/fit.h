#pragma once
/// Fits ellipsoids to a sparse volume.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esvr/coord.h"
#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "esvr/fit_record.h"
#include "esvr/progress.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// Chooses the number of ellipsoids and the length of the schedule where they are not given.
enum class Preset { kDraft, kStandard, kHigh };

/// The state of a running fit. It is reported about four times a second.
struct FitProgress {
  TimedCurvePoint point;
  double fraction = 0.0;     ///< share of the run that is done, 0..1
  double secondsLeft = 0.0;  ///< estimate
};

/// What every fit takes, by our method or by the paper's: when it ends, where it runs and who
/// watches it.
struct CommonFitOptions {
  std::optional<std::size_t> count;  ///< ellipsoids; default: the method's own number
  std::optional<double> psnr;        ///< dB over the box: the fit ends as soon as it is reached
  std::optional<double> seconds;     ///< the fit ends after this time, with the best it has then
  std::optional<Box> box;            ///< box over which PSNR is taken; default: the active voxels'
  std::uint64_t seed = 1;
  Device device;                              ///< the CPU, or a GPU (selectDevice)
  std::optional<std::size_t> maxDeviceBytes;  ///< GPU memory to use; default: what is free
  const CancelToken* cancel = nullptr;  ///< a cancelled fit returns the best so far, marked so
  std::function<void(const FitProgress&)> progress;
};

/// The options of our method. Targets combine: the run ends at the first of psnr, seconds and
/// iterations that is met. What is not given follows from the preset and the data.
struct FitOptions : CommonFitOptions {
  std::optional<std::uint32_t> iterations;  ///< length of the schedule
  Preset preset = Preset::kStandard;
  std::optional<float> kappa;  ///< the scene's edge; default: it is fitted with the ellipsoids
  /// The volume is a level set: values beyond its range count as the range's ends, because they
  /// saturate when the grid is revoxelised as a narrow band, and what lies outside the volume's
  /// bricks does not count.
  bool narrowBand = false;
};

enum class FitEnd { kScheduleDone, kPsnrReached, kTimeUp, kCancelled, kPsnrMissed };

struct FitResult {
  Field field;
  std::vector<TimedCurvePoint> curve;
  FitEnd end = FitEnd::kScheduleDone;
  bool kappaLearned = false;  ///< true where kappa was fitted, false where it was given
  /// Wall clock by phase; seeding (at the start, growth, relocation) is not in secondsOptimise.
  double secondsSeed = 0.0, secondsOptimise = 0.0;
  std::size_t deviceBytes = 0;     ///< the most GPU memory that was held; 0 on the CPU
  std::uint64_t pairs = 0;         ///< (ellipsoid, brick) pairs that the final field evaluates
  bool signedIntensities = false;  ///< some intensity is negative
};

/// Deterministic: the same volume, options and seed give the same bits on any number of threads and
/// in every run on a GPU of one kind, unless `seconds` ends the run. CPU and GPU follow the same
/// method and the same math, but round differently, so that their fits differ in detail.
/// \return  a fit that was given a PSNR and ended without reaching it is marked kPsnrMissed; the
///          search for the smallest number of ellipsoids that reaches a PSNR is convert.h's
/// \throws BadInput  no active voxel; UsageError: count 0, options that contradict each other;
///         Cancelled: before there was anything to return; DeviceError: the GPU cannot be used or
///         has too little memory; RuntimeFailure: the fit diverged
[[nodiscard]] FitResult fit(const SparseVolume& volume, const FitOptions& options);

}  // namespace esvr
