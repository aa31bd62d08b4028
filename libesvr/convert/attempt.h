#pragma once
/// One fit of a search, stored as float32: what searches for a size and for a PSNR are made of.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "esvr/compact.h"
#include "esvr/convert.h"

namespace esvr::convert {

/// What a search converts, and how. It borrows both.
struct Job {
  const ConvertInput& input;
  const ConvertOptions& options;
};

/// The same fit, shorter: a draft, or a quarter of the iterations where their number is given.
[[nodiscard]] FitOptions shortened(FitOptions options);

enum class FitLength { kShort, kWhole };

struct Attempt {
  FitResult fit;    ///< without its field
  StoredGrid grid;  ///< float32
  double psnr = 0.0;
  std::size_t asked = 0;  ///< ellipsoids; the grid may hold fewer

  [[nodiscard]] std::size_t count() const { return grid.field.ellipsoidCount(); }
  [[nodiscard]] bool cancelled() const { return fit.end == FitEnd::kCancelled; }
};

/// Fits about so many ellipsoids: at least one, at most as many as there are active voxels.
[[nodiscard]] Attempt attempt(const Job& job, double count, FitLength length);

/// PSNR that quantising costs where bytes are short, dB: there the same bytes do as much in more
/// ellipsoids as in more bits. Measured on six volumes of docs/benchmarks.md.
inline constexpr double kUsualLoss = 0.9;

/// How an attempt is to be stored: at most this loss, unless a PSNR or a number of bytes is given.
struct StorageTarget {
  double loss = kUsualLoss;
  std::optional<double> psnr{};          ///< dB over the box
  std::optional<std::uint64_t> bytes{};  ///< of the ellipsoids' section
};
[[nodiscard]] CompactResult compacted(const Job& job, const Attempt& attempt,
                                      const StorageTarget& target);

/// The conversion that consists of a fit and its compact form.
[[nodiscard]] Conversion conversionOf(FitResult fit, CompactResult compact);

/// The conversion that consists of a fit and its float32 form.
[[nodiscard]] Conversion conversionOf(Attempt attempt);

}  // namespace esvr::convert
