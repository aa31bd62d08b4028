#pragma once
/// What the parts of the encoder work on: a volume with its goal, its measure, and the plan that the
/// effort allows.

#include <cstdint>
#include <optional>

#include "esvr/encode.h"
#include "esvr/error.h"

namespace esvr::encode {

/// The input and the options of a conversion, which a job does not own.
struct Job {
  const ConvertInput& input;
  const ConvertOptions& options;
};

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

/// PSNR of a volume or of a decoded grid over the box, dB.
[[nodiscard]] double psnrOf(const Job& job, const SparseVolume& volume);
[[nodiscard]] double psnrOf(const Job& job, const StoredGrid& grid);

/// The representation of a job. Float32 storage is a form of ellipsoids.
[[nodiscard]] Representation representationOf(const Job& job);

/// How much work a conversion may do, by its effort, its device and its size. It does not depend on
/// measured times, so that the result does not either.
struct Plan {
  std::uint32_t wholeIterations = 0, shortIterations = 0;
  int wholeFits = 2;       ///< largest number of whole fits, of which a continued one is one
  bool fitsInTime = true;  ///< false: a fit would take too long for the effort
};
[[nodiscard]] Plan planOf(const Job& job);

/// The number by which an effort multiplies the iterations of a fit. A step below the usual effort
/// halves them; a step above it makes them half as many again.
[[nodiscard]] double effortFactor(int effort);

}  // namespace esvr::encode
