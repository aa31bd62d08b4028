#pragma once
/// The search for the best grid of a given size.

#include <cstdint>
#include <optional>

#include "convert/attempt.h"

namespace esvr::convert {

struct SizeResult {
  std::optional<Conversion> conversion;  ///< missing if even the smallest grid is too large
  std::uint64_t needed = 0;              ///< if so, bytes of the smallest grid that was tried
};

/// Makes a short fit to measure the bytes per ellipsoid, and then a full fit with as many
/// ellipsoids as the size allows. If the ellipsoids of the full fit take more bytes than expected,
/// it is repeated with fewer.
/// \param bytes  largest number of bytes that the grid may add to a file (bytesAdded)
[[nodiscard]] SizeResult searchSize(const Job& job, std::uint64_t bytes);

}  // namespace esvr::convert
