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

/// \return the most ellipsoids, `wanted` at most, whose fit stays within the memory; 0 where the
///         bricks alone do not
[[nodiscard]] std::size_t affordableEllipsoids(const FitTarget& target, std::size_t wanted,
                                               std::optional<std::size_t> maxBytes);

/// Whether a fit of the target with few ellipsoids leaves half of the memory free.
[[nodiscard]] bool fitsInMemory(const FitTarget& target, std::optional<std::size_t> maxBytes);

}  // namespace esvr::cuda
