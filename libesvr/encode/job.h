#pragma once
/// What the parts of the encoder work on: a volume with its goal, its measure, and the plan that the
/// effort allows.

#include <cstdint>
#include <optional>
#include <string>

#include "esvr/encode.h"
#include "esvr/error.h"

namespace esvr::encode {

class Judge;

/// What a search is to reach: a quality in few bytes, or a size with a good quality.
struct Aim {
  std::optional<double> psnr{};  ///< dB, as the job measures it
  std::optional<std::uint64_t>
      bytes{};  ///< the bytes that the grid may add to a file, without a PSNR
};

/// The quality, dB, of a fit for which a number of ellipsoids was wanted.
struct FitPoint {
  double count = 0.0, psnr = 0.0;
};

/// The input and the options of a conversion, which a job does not own.
struct Job {
  const ConvertInput& input;  ///< has the tones of the values if there is a tone curve
  const ConvertOptions& options;
  const Judge* judge = nullptr;  ///< null: quality is the PSNR over the box
  /// What the fit showed by which the tone curve was chosen. The number of ellipsoids of the first short fit follows from it.
  std::optional<FitPoint> scout{};
  /// The averages of kAveraged^3 voxels of the input, to which ellipsoids are fitted in its place; null: they are fitted to
  /// the input. They are always judged with the input.
  const SparseVolume* averages = nullptr;
};
inline constexpr int kAveraged = 2;

/// True if the conversion was cancelled. What it has so far is then completed in the shortest way.
[[nodiscard]] bool isCancelled(const Job& job);

/// The result of `work`; an empty one if it was cancelled before it had one. It lets a search end
/// with what it has found before.
template <class Work>
[[nodiscard]] auto unlessCancelled(const Work& work) -> decltype(work()) try {
  return work();
} catch (const Cancelled&) {
  return {};
}

/// The values of the input, which are not those of a job with a tone curve.
[[nodiscard]] const SparseVolume& valuesOf(const Job& job);

/// The number of voxels in a box that were filled (ConvertOptions::filled).
[[nodiscard]] std::uint64_t filledIn(const Box& box, const ConvertOptions& options);

/// dB that the PSNR over the box of a volume is above that over the active voxels in the box, without those that were
/// filled, if all errors are at these.
[[nodiscard]] double boxGain(const SparseVolume& volume, const ConvertOptions& options);

/// True if the input of the job has the tones of a curve.
[[nodiscard]] bool isToned(const Job& job);

/// True if the quality of the job is what is seen.
[[nodiscard]] bool seesPictures(const Job& job);

/// Makes the voxels of a decoded volume that were filled (ConvertOptions::filled) equal to those of the source, so that
/// their errors count in no PSNR. \param filled  null: none were (tone.cpp)
void forgiveFilled(const SparseVolume& source, const VoxelLayer* filled, SparseVolume& volume);

/// Quality of a volume or of a decoded grid, dB: by the job's judge (tone.h), or its PSNR over the box.
[[nodiscard]] double psnrOf(const Job& job, SparseVolume volume);
[[nodiscard]] double psnrOf(const Job& job, const StoredGrid& grid);

/// The representation of a job. Float32 storage is a form of ellipsoids.
[[nodiscard]] Representation representationOf(const Job& job);

/// The most iterations of a short fit. With 100, fit/tuning.h makes the most of them.
inline constexpr std::uint32_t kMostShortIterations = 100;

/// How much work a conversion may do, by its effort, its device and its size. It does not depend on
/// measured times, so that the result does not either.
struct Plan {
  std::uint32_t wholeIterations = 0, shortIterations = 0;
  int wholeFits = 2;     ///< largest number of whole fits, of which a continued one is one
  bool probes = false;   ///< whether a longer short fit comes before the first whole one for a PSNR
  bool improves = true;  ///< whether a whole fit for a PSNR may follow one that reaches it
  bool fitsInTime = true;  ///< false: a fit would take too long for the effort
};
[[nodiscard]] Plan planOf(const Job& job);

/// The number by which an effort multiplies the iterations of a fit: 1.6 for each step from the usual one. Three
/// steps below, smoke1 takes 11 % more bytes in half of the seconds; with fewer iterations, both become more.
[[nodiscard]] double effortFactor(int effort);

}  // namespace esvr::encode
