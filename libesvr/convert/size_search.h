#pragma once
/// The best grid of so many bytes.

#include <cstdint>
#include <optional>

#include "convert/attempt.h"

namespace esvr::convert {

struct SizeResult {
  std::optional<Conversion> conversion;  ///< nothing where even the smallest grid is larger
  std::uint64_t needed = 0;              ///< bytes of the smallest grid that was tried, then
};

/// A short fit tells what an ellipsoid costs, and a whole one has as many as fit. Where the short
/// fit promised too much, the whole one is repeated with fewer.
/// \param bytes  the grid may add so many to a file (bytesAdded)
[[nodiscard]] SizeResult searchSize(const Job& job, std::uint64_t bytes);

}  // namespace esvr::convert
