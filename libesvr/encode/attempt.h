#pragma once
/// Single fits of a search, and what becomes of them: grids in float32, compacted grids, and conversions.

#include <algorithm>
#include <cstdint>
#include <functional>

#include "encode/job.h"
#include "encode/rate_control.h"

namespace esvr::encode {

/// A fit, and its grid in float32.
struct Attempt {
  FitResult fit;          ///< its field was moved to the grid
  StoredGrid grid;        ///< grid in float32
  double psnr = 0.0;      ///< quality, dB
  double forTones = 0.0;  ///< Judge::Judgement::forTones
  /// PSNR over the box of the input, dB, if the fit is one to its averages, of which the fit's own PSNR is.
  double psnrOfVoxels = 0.0;
  std::size_t asked = 0;  ///< wanted number of ellipsoids; the grid may have fewer

  [[nodiscard]] std::size_t count() const { return grid.field.ellipsoidCount(); }
  [[nodiscard]] bool cancelled() const { return fit.end == FitEnd::kCancelled; }
};

/// The number of ellipsoids, or 1, by which bytes may be divided.
[[nodiscard]] inline double countOf(const Attempt& a) {
  return double(std::max<std::size_t>(a.count(), 1));
}

/// The options of a fit of a number of ellipsoids.
[[nodiscard]] FitOptions optionsFor(const Job& job, double count, std::uint32_t iterations);

/// Makes a fit, and measures it.
[[nodiscard]] Attempt attempted(const Job& job, const FitOptions& options);

/// A short fit, by itself.
/// \param count  wanted number of ellipsoids
[[nodiscard]] Attempt shortFitOf(const Job& job, double count);

/// PSNR of the sum over the box at the end of a fit, as the device of the fit measures it.
[[nodiscard]] double lastPsnr(const FitResult& fit);

/// Makes the stored grid of a fit, and takes its field. If the conversion is cancelled, active voxels
/// are found by value, and the end of the fit becomes kCancelled.
[[nodiscard]] StoredGrid storedGridOf(const Job& job, FitResult& fit);

/// Makes a conversion of a fit and its grid in float32, in the form that the options want: compacted
/// to the target unless the storage is kFloat32.
/// \param target  its loss, psnr and bytes count; the rest follows from the job
[[nodiscard]] Conversion storedAs(const Job& job, FitResult fit, StoredGrid grid,
                                  const CompactOptions& target);

/// The PSNR of a conversion over the box, dB: measured, or, if that is cancelled, what the fit and rate
/// control have measured.
[[nodiscard]] double psnrOf(const Job& job, const Conversion& conversion);

/// bytesAdded() of a grid of ellipsoids, which takes little time, so that nothing cancels it.
[[nodiscard]] std::uint64_t bytesOfEllipsoids(const StoredGrid& grid);

/// Compacts a grid: quickly (CompactOptions::quick) if the fit was cancelled, or if the conversion is
/// cancelled meanwhile. Rate control passes over the whole volume on the device of the fit, or on the
/// CPU if the fit was divided into chunks, because the volume may not fit into the GPU's memory.
/// \param round  makes the result; its argument is the target with the box, the peak and the device of the job
[[nodiscard]] CompactResult roundedBy(
    const Job& job, const StoredGrid& grid, const FitResult& fit, CompactOptions target,
    const std::function<CompactResult(const CompactOptions&)>& round);
[[nodiscard]] CompactResult compactedTo(const Job& job, const StoredGrid& grid,
                                        const FitResult& fit, const CompactOptions& target);
[[nodiscard]] Conversion conversionOf(FitResult fit, CompactResult compact);

/// The bytes that sections of ellipsoids may take besides those that rate control counts.
[[nodiscard]] std::uint64_t paddingOf(const CompactResult& made);

/// True if many active voxels have an extreme value of the volume, so that both signs of intensities
/// may be better.
[[nodiscard]] bool saturates(const SparseVolume& volume);

}  // namespace esvr::encode
