#pragma once
/// The search for the smallest grid that reaches a PSNR.

#include <cstdint>
#include <functional>
#include <optional>

#include "convert/attempt.h"

namespace esvr::convert {

struct PsnrResult {
  std::optional<Conversion> conversion;  ///< missing if it would be larger than allowed
  std::uint64_t expected = 0;            ///< bytes to expect according to the short fit
};

/// Makes a short fit and then full fits, each with a number of ellipsoids that follows from the
/// PSNR of the fits before. If the PSNR is out of reach, the result is the best of them with
/// FitEnd::kPsnrMissed.
/// \param psnr   dB over the box
/// \param below  bytes below which the grid must stay; no full fit is made if the short fit shows
///               that it would not
[[nodiscard]] PsnrResult searchPsnr(const Job& job, double psnr,
                                    std::optional<std::uint64_t> below = {});

/// The rest of a search whose short fits are done.
/// \param below  as for searchPsnr()
using RestOfSearch = std::function<PsnrResult(std::optional<std::uint64_t> below)>;

/// Makes the short fits of a search before `below` is known.
/// \param cancel  cancels these short fits, instead of the job's token
/// \return the rest, which may be called once while the job exists
/// \throws Cancelled  a short fit was cancelled before it had a result
[[nodiscard]] RestOfSearch startPsnrSearch(const Job& job, double psnr, const CancelToken& cancel);

}  // namespace esvr::convert
