#pragma once
/// The search for the best grid of a given size.

#include <cstdint>
#include <functional>
#include <optional>

#include "convert/attempt.h"

namespace esvr::convert {

struct SizeResult {
  /// Missing if even the smallest grid is too large, or if it would be worse than allowed.
  std::optional<Conversion> conversion;
  std::uint64_t needed = 0;  ///< bytes of the smallest grid that was tried, if it is too large
  double expected = 0.0;     ///< PSNR to expect according to the short fit, dB
};

/// Makes a short fit to measure the bytes per ellipsoid, and then a full fit with as many
/// ellipsoids as the size allows. If the ellipsoids of the full fit take more bytes than expected,
/// it is repeated with fewer.
/// \param bytes  largest number of bytes that the grid may add to a file (bytesAdded)
/// \param above  PSNR in dB that the result must exceed; no full fit is made if the short fit shows
///               that it would not
[[nodiscard]] SizeResult searchSize(const Job& job, std::uint64_t bytes,
                                    std::optional<double> above = {});

/// A search whose short fit is done.
struct StartedSizeSearch {
  double expected = 0.0;  ///< PSNR to expect, dB
  /// The rest, which may be called once while the job exists.
  std::function<SizeResult(std::optional<double> above)> rest;
};

/// Makes the short fit of a search before `above` is known.
/// \throws Cancelled  the fit was cancelled before it had a result
[[nodiscard]] StartedSizeSearch startSizeSearch(const Job& job, std::uint64_t bytes);

}  // namespace esvr::convert
