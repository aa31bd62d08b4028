#pragma once
/// Predicts the device memory of a fit before it is allocated, and chooses what is kept when it
/// runs out.

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "fit/target.h"

namespace esvr::cuda {

/// Bytes that a fit of this number of ellipsoids takes, from the sizes of its arrays. The number of
/// pairs is estimated from the distance between neighbouring ellipsoids.
[[nodiscard]] std::size_t predictedBytes(const FitTarget& target, std::size_t ellipsoids);

/// \param maxBytes  limit that the user set; default: the free memory of the current device
/// \param extra     bytes that are needed in addition to predictedBytes()
/// \throws DeviceError  the fit needs more; the message says how many ellipsoids would fit
void requireMemory(const FitTarget& target, std::size_t ellipsoids,
                   std::optional<std::size_t> maxBytes, double extra = 0.0);

/// \return the largest number of ellipsoids, at most `wanted`, whose fit stays within the memory; 0
///         if the bricks alone do not fit
[[nodiscard]] std::size_t affordableEllipsoids(const FitTarget& target, std::size_t wanted,
                                               std::optional<std::size_t> maxBytes);

/// True if a fit of the target with few ellipsoids leaves half of the memory free.
[[nodiscard]] bool fitsInMemory(const FitTarget& target, std::optional<std::size_t> maxBytes);

/// True if a fit of this size with this number of ellipsoids, at least 1, stays within the memory.
[[nodiscard]] bool fitsInMemory(const FitSize& size, std::size_t ellipsoids,
                                std::optional<std::size_t> maxBytes);

/// \return the places of all values but the `dropped` lowest ones, in increasing order. If values
///         are equal, the first ones are dropped.
[[nodiscard]] std::vector<std::size_t> allButLowest(std::span<const double> values,
                                                    std::size_t dropped);

}  // namespace esvr::cuda
