#pragma once
/// How much device memory a fit takes, before it takes it.

#include <cstddef>
#include <optional>

#include "fit/target.h"

namespace esvr::cuda {

/// Bytes that a fit of so many ellipsoids comes to at most, by the sizes of its arrays. How many
/// pairs there will be is an estimate from the distance of neighbouring ellipsoids.
[[nodiscard]] std::size_t predictedBytes(const FitTarget& target, std::size_t ellipsoids);

/// \param maxBytes  bytes the user allows; none: what is free on the current device
/// \param extra  bytes that the fit takes besides what every fit does
/// \throws DeviceError  a fit of so many ellipsoids would take more; says how many would fit
void requireMemory(const FitTarget& target, std::size_t ellipsoids,
                   std::optional<std::size_t> maxBytes, double extra = 0.0);

/// Whether a fit of the target with few ellipsoids leaves half of the memory free.
[[nodiscard]] bool fitsInMemory(const FitTarget& target, std::optional<std::size_t> maxBytes);

/// The most bytes that the current device's pool has handed out since the last call of
/// forgetPeakMemory().
[[nodiscard]] std::size_t peakMemory();
void forgetPeakMemory();

}  // namespace esvr::cuda
