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
#include "esvr/paper_method.h"
#include "esvr/progress.h"
#include "esvr/sparse_volume.h"

namespace esvr {

enum class Loss {
  kSquared,  ///< mean squared error: what PSNR asks for
  kPaper     ///< beta L1 + (1 - beta) D-SSIM (paper, eq. 7)
};
enum class Preset { kDraft, kStandard, kHigh };

/// What a run reports while it goes on, about four times a second.
struct FitProgress {
  TimedCurvePoint point;
  double fraction = 0.0;     ///< of the run, 0..1
  double secondsLeft = 0.0;  ///< estimate
};

/// What to reach. Targets combine: the run ends at the first of psnr, seconds and iterations that
/// is met; all that are not given follow from the preset and the data.
struct FitOptions {
  std::optional<std::size_t> count;         ///< ellipsoids; with psnr: at most so many
  std::optional<double> psnr;               ///< dB over the box; grows until reached
  std::optional<double> seconds;            ///< best within a time
  std::optional<std::uint32_t> iterations;  ///< length of the schedule
  Preset preset = Preset::kStandard;
  Loss loss = Loss::kSquared;
  double beta = 0.2;           ///< of the paper's loss
  std::optional<float> kappa;  ///< the scene's edge; default: fitted, for squared errors
  std::optional<Box> box;      ///< of 'PSNR over the box'; default: the active bounding box
  /// Instead of all else that decides how: the paper's method, with its own loss and kernel. Takes
  /// no kappa and no iterations; `count` is what its last pruning leaves.
  std::optional<PaperMethod> paper;
  /// A level set: values beyond the volume's range count as its ends (they saturate when the grid
  /// is revoxelised as a narrow band), and what lies outside its bricks counts for nothing.
  bool narrowBand = false;
  std::uint64_t seed = 1;
  Device device;                              ///< the CPU, or a GPU (selectDevice)
  std::optional<std::size_t> maxDeviceBytes;  ///< GPU memory to use; default: what is free
  const CancelToken* cancel = nullptr;  ///< a cancelled fit returns the best so far, marked so
  std::function<void(const FitProgress&)> progress;
};

enum class FitEnd { kScheduleDone, kPsnrReached, kTimeUp, kCancelled, kPsnrMissed };

struct FitResult {
  Field field;
  std::vector<TimedCurvePoint> curve;
  FitEnd end = FitEnd::kScheduleDone;
  bool kappaLearned = false;  ///< else it was given
  /// Wall clock by phase; seeding (at the start, growth, relocation) is not in secondsOptimise.
  double secondsSeed = 0.0, secondsOptimise = 0.0;
  std::size_t deviceBytes = 0;       ///< GPU memory held at most; 0 on the CPU
  std::uint64_t pairs = 0;           ///< (ellipsoid, brick) pairs that the final field evaluates
  bool signedIntensities = false;    ///< some intensity is negative
  std::optional<PaperRecord> paper;  ///< where FitOptions::paper was given
};

/// Deterministic: the same volume, options and seed give the same bits on any number of threads and
/// in every run on a GPU of one kind, unless `seconds` ends the run. CPU and GPU follow the same
/// method and the same math, but round differently, so that their fits differ in detail.
/// \throws BadInput  no active voxel; UsageError: count 0, options that contradict each other;
///         Cancelled: before there was anything to return; DeviceError: the GPU cannot be used or
///         has too little memory; RuntimeFailure: the fit diverged
[[nodiscard]] FitResult fit(const SparseVolume& volume, const FitOptions& options);

}  // namespace esvr
